"""numba's compiler, with a cache that a read-only install, rot and many processes do not harm."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from numba import njit
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    InTreeCacheLocator,
    UserProvidedCacheLocator,
)
from numba.core.serialize import dumps

from bsip_cli.caches import cache_home

F = TypeVar("F", bound=Callable[..., Any])
_Key = tuple[Any, Any, Any]  # signature, machine, and what the function closes over
_DIGEST = hashlib.sha256().digest_size


def compiled(function: F) -> F:
    """Compile a function when it is first called; the next process finds it in the cache."""
    dispatcher = njit(function)
    with suppress(RuntimeError):  # numba found no place for a cache: each process compiles anew
        dispatcher._cache = _Cache(function)
    return dispatcher


class _InCacheHome(InTreeCacheLocator):
    """Below the user's cache folder, if there is one; numba's own way there trusts any folder."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        super().__init__(function, file)
        if home := cache_home():
            self._cache_path = str(home / "bsip" / self.get_suitable_cache_subpath(file))


class _Places(CompileResultCacheImpl):
    """NUMBA_CACHE_DIR, else next to the code, else the user's cache folder."""

    _locator_classes = [  # noqa: RUF012 (as numba declares it)
        UserProvidedCacheLocator,
        InTreeCacheLocator,
        _InCacheHome,
    ]


class _Sealed(IndexDataCacheFile):
    """A file for each function and signature, behind the SHA-256 of its origin and its content.

    numba runs what rot made of a file, fails at one cut short, and two processes that write at
    once may leave its index naming the code of another signature.
    """

    def load(self, key: _Key) -> Any:
        try:
            stored = self._path(key).read_bytes()
        except OSError:  # not there, or not to be read: compiled anew
            return None
        seal, code = stored[:_DIGEST], stored[_DIGEST:]
        return pickle.loads(code) if seal == self._seal(key, code) else None

    def save(self, key: _Key, data: Any) -> None:
        code = dumps(data)
        with self._open_for_write(str(self._path(key))) as file:
            file.write(self._seal(key, code) + code)

    def _path(self, key: _Key) -> Path:
        signature, machine, _ = key
        digest = hashlib.sha256(repr((signature, machine)).encode()).hexdigest()
        return Path(self._index_path).with_suffix(f".{digest[:12]}.nbc")

    def _seal(self, key: _Key, code: bytes) -> bytes:
        origin = repr((self._version, self._source_stamp, key))
        return hashlib.sha256(origin.encode() + code).digest()


class _Cache(FunctionCache):
    _impl_class = _Places

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _Sealed(self._cache_path, self._impl.filename_base, stamp)

    def save_overload(self, signature: Any, data: Any) -> None:
        with suppress(OSError):  # a full disk, say: this process has what it compiled
            super().save_overload(signature, data)
