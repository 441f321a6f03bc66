"""Read and write artifacts: Parquet files that follow a schema and say what made them."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from bsip_cli.errors import BadDataError, ChangedError, UsageError, not_writable
from bsip_cli.files.fingerprints import BLANK, SEAL, file_hash, fingerprint, forget, seal
from bsip_cli.schemas import SCHEMAS, Schema, column_names

_TYPES = {"float": pa.float64(), "int": pa.int64(), "bool": pa.bool_(), "text": pa.string()}

_MADE_BY = dict.fromkeys(("stage", "bsip_version"), str | None) | dict.fromkeys(
    ("libraries", "inputs", "options"), dict | None
)
_SHAPE = {
    "kind": str,
    "schema_version": int,
    "provenance": {"made_by": _MADE_BY, "messages": [str], "facts": dict},
}

_LOCK, _UNFINISHED, _NOTES = ".lock", ".bsip-part", ("unit", "frame", "meaning")

Rows = pd.DataFrame | Sequence[Mapping[str, Any]]
Provenance = Mapping[str, Any]
"""A table, or its rows."""


def empty_table(kind: str) -> pd.DataFrame:
    """A table of this kind without rows."""
    return pd.DataFrame({column.name: [] for column in SCHEMAS[kind].columns}, dtype=object)


def table_of(kind: str, rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Rows as a table: of each the columns of this kind, which all must have, and what there is of
    its families of columns."""
    names = column_names(kind)
    if lacking := {name for row in rows for name in names if name not in row}:
        raise ValueError(f"{kind}: missing columns {sorted(lacking)}")
    others = (name for row in rows for name in row if name not in names)
    families = dict.fromkeys(name for name in others if SCHEMAS[kind].column(name))
    return pd.DataFrame(list(rows), columns=[*names, *families])


def as_read(kind: str, frame: Rows) -> pd.DataFrame:
    """A table as it comes back from a file: the columns' types are those of its kind."""
    return _to_arrow(SCHEMAS[kind], frame).to_pandas()


def write_artifact(path: Path, kind: str, frame: Rows, provenance: Provenance) -> None:
    """Write a table under its final name only when it is whole.

    frame : columns as the kind's schema says; a missing or an unknown one is a bug. Or rows, of
        which these columns are written.
    provenance : what made it; stored as JSON in the file's metadata.
    """
    header = _header(SCHEMAS[kind], provenance)
    table = _to_arrow(SCHEMAS[kind], frame).replace_schema_metadata(header)

    def write(temporary: Path) -> None:
        _write_tables(temporary, table.schema, [table])
        seal(temporary)

    write_atomically(path, write)


def write_artifact_in_parts(
    path: Path, kind: str, parts: Iterable[pd.DataFrame], provenance: Callable[[], Provenance]
) -> None:
    """Write a table that is longer than the memory; a row group for each part.

    provenance : asked for when the last part is written.
    """
    layout = SCHEMAS[kind]
    schema = pa.schema(_fields(layout, column_names(kind)))
    tables = (_to_arrow(layout, part[schema.names]) for part in parts)

    def write(temporary: Path) -> None:
        rows = temporary.with_name(f"{temporary.name}{_UNFINISHED}")
        try:
            _write_tables(rows, schema, tables)
            whole = schema.with_metadata(_header(layout, provenance()))
            with pq.ParquetFile(rows) as file:
                _write_tables(temporary, whole, _row_groups(file))
            seal(temporary)
        finally:
            rows.unlink(missing_ok=True)

    write_atomically(path, write)


def _write_tables(path: Path, schema: pa.Schema, tables: Iterable[pa.Table]) -> None:
    words = [field.name for field in schema if field.type == pa.string()]  # numbers hardly repeat
    options = {"compression": "zstd", "write_page_checksum": True, "use_dictionary": words}
    with pq.ParquetWriter(path, schema, **options) as writer:
        for table in tables:
            writer.write_table(table.replace_schema_metadata(schema.metadata))
        writer.add_key_value_metadata({SEAL: BLANK})


def _row_groups(file: pq.ParquetFile) -> Iterator[pa.Table]:
    return map(file.read_row_group, range(file.num_row_groups))


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Call ``write`` with a temporary path next to ``path``, then rename it into place.

    NotWritableError: the disk is full, or the place cannot be written to; what was there stays.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}{_UNFINISHED}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            write(temporary)
            with temporary.open("rb") as handle:
                os.fsync(handle.fileno())
            temporary.replace(path)
        except BaseException:  # once it has its final name, nothing is left that could fail
            temporary.unlink(missing_ok=True)
            raise
        forget(path)
    except OSError as error:
        raise not_writable(path, error) from None


def write_bytes(path: Path, content: bytes) -> Path:
    """A small file, whole or not at all."""
    write_atomically(path, lambda temporary: temporary.write_bytes(content))
    return path


def file_rows(out: Path, files: Iterable[Path]) -> list[dict[str, str]]:
    """Of the artifacts that list files: each by its path below ``out``, with its hash."""
    return [{"file": file.relative_to(out).as_posix(), "sha256": file_hash(file)} for file in files]


def remove_unfinished(folder: Path) -> None:
    """Take away what killed processes left half written; only for who holds the folder alone."""
    for left in folder.rglob(f".*{_UNFINISHED}"):
        remove(left)


def remove(path: Path) -> None:
    """Take a file away, if it is there.

    NotWritableError: the place is closed.
    """
    try:
        path.unlink(missing_ok=True)
        forget(path)
    except OSError as error:
        raise not_writable(path, error) from None


def read_artifact(path: Path, kind: str, **wanted: Collection[str]) -> pd.DataFrame:
    """Read a table of a known kind and version.

    wanted : by the name of a text column, the values of which rows are read; the others never
        come into memory all at once.

    BadDataError: the file is not an artifact of this kind, has changed since it was written, or is
        of a version this bsip does not know.
    """
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            _check_kind(file.schema_arrow, SCHEMAS[kind], path)
            _check_intact(path)
            if not wanted:
                return file.read().to_pandas()
            are_wanted = pq.filters_to_expression([(c, "in", v) for c, v in wanted.items()])
            parts = [table.filter(are_wanted) for table in _row_groups(file)]
            return pa.concat_tables([file.schema_arrow.empty_table(), *parts]).to_pandas()
    except (OSError, pa.ArrowException, KeyError, ValueError) as error:
        raise _not_an_artifact(path, error) from None


def read_header(path: Path, kind: str | None = None) -> dict[str, Any]:
    """Kind, schema version and provenance of an artifact, without its data.

    BadDataError: the file is missing, is not an artifact or has changed since it was written; with
        ``kind``, it is of another kind or version.
    """
    try:
        as_written = pq.read_schema(path)
        found = _header_in(as_written)
    except (OSError, pa.ArrowException, KeyError, ValueError) as error:
        raise _not_an_artifact(path, error) from None
    if kind is not None:
        _check_kind(as_written, SCHEMAS[kind], path)
    _check_intact(path)
    return found


def is_made_from(path: Path, source: Path) -> bool:
    """Whether an artifact was made from an input as it stands now.

    BadDataError: ``path`` is missing or is not an artifact.
    """
    known = read_header(path)["provenance"]["made_by"]["inputs"]
    return source.exists() and known.get(source.name) == file_hash(source)


def _check_intact(path: Path) -> None:
    intact = fingerprint(path).intact
    if not intact:
        changed, unsealed = "has changed since bsip wrote it", "has no seal of bsip"
        raise ChangedError(
            unsealed if intact is None else changed,
            file=path,
            expected="the content that was sealed when it was written",
            remedy="run `bsip run` again: it is made anew",
        )


def _header_in(schema: pa.Schema) -> dict[str, Any]:
    """What made a table; KeyError or ValueError where that is not said as bsip says it."""
    try:
        found = json.loads((schema.metadata or {})[b"bsip"])
    except RecursionError:
        raise ValueError("brackets without end") from None
    if not (
        _has_shape(found, _SHAPE)
        and _has_shape(found["provenance"].get("amended_by", {}), _MADE_BY)
    ):
        raise ValueError("another shape")
    return found


def _has_shape(value: Any, shape: Any) -> bool:
    """Whether a value of JSON is of a type, or has a shape for each of these keys."""
    if isinstance(shape, dict):
        return isinstance(value, dict) and all(
            _has_shape(value.get(key), part) for key, part in shape.items()
        )
    if isinstance(shape, list):
        return isinstance(value, list) and all(_has_shape(part, shape[0]) for part in value)
    return isinstance(value, shape)


def _check_kind(as_written: pa.Schema, schema: Schema, path: Path) -> None:
    found = _header_in(as_written)
    have = f"{found.get('kind', 'an unknown table')} version {found.get('schema_version')}"
    expected = f"{schema.kind} version {schema.version}"
    if have == expected:
        missing, unknown = _other_columns(schema, as_written.names)
        if not missing and not unknown:
            return
        changes = (("without", missing), ("with", unknown))
        some = (f"{word} {', '.join(names)}" for word, names in changes if names)
        have = f"{schema.kind} {' and '.join(some)}, as another version of bsip wrote it"
        expected = f"the columns of {schema.kind} in docs/artifacts.md"
    raise BadDataError(
        f"holds {have}",
        expected=expected,
        file=path,
        remedy=f"run `bsip {found['provenance']['made_by'].get('stage', 'STAGE')}` again",
    )


def _other_columns(schema: Schema, names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Those that are missing, and those that are unknown."""
    plain = [column.name for column in schema.columns if not column.name.endswith("*")]
    missing = [name for name in plain if name not in names]
    return missing, [name for name in names if schema.column(name) is None]


def _not_an_artifact(path: Path, error: Exception) -> BadDataError:
    return BadDataError(
        f"is not an artifact of bsip ({type(error).__name__})",
        file=path,
        expected="a Parquet file that a stage wrote",
        remedy="run the stage again with --force",
    )


def _to_arrow(schema: Schema, rows: Rows) -> pa.Table:
    frame = rows if isinstance(rows, pd.DataFrame) else table_of(schema.kind, rows)
    missing, unknown = _other_columns(schema, list(frame.columns))
    if missing or unknown:
        raise ValueError(f"{schema.kind}: missing columns {missing}, unknown columns {unknown}")
    fields = _fields(schema, list(frame.columns))
    arrays = [
        pa.array(_plain(frame[field.name]), type=field.type, from_pandas=False) for field in fields
    ]
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields))


def _fields(schema: Schema, names: list[str]) -> list[pa.Field]:
    known = ((name, column) for name in names if (column := schema.column(name)))
    return [
        pa.field(name, _TYPES[c.type], metadata={k: getattr(c, k) for k in _NOTES})
        for name, c in known
    ]


def _header(schema: Schema, provenance: Provenance) -> dict[str, str]:
    header = {"kind": schema.kind, "schema_version": schema.version, "provenance": provenance}
    return {"bsip": json.dumps(header, sort_keys=True)}


def _plain(series: pd.Series) -> Any:
    if series.dtype.kind in "fib":
        return series.to_numpy()
    if isinstance(series.dtype, pd.CategoricalDtype):
        return pa.array(series).cast(pa.string())
    return np.asarray(series, dtype=object)


# --- only one program at a time writes into a folder of results -------------------------------


@contextmanager
def held_alone(folder: Path) -> Iterator[None]:
    """Hold a folder's lock; the system lets go of it whatever becomes of the process.

    What killed processes left half written there is taken away.

    UsageError: another process holds it, or the folder cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle = (folder / _LOCK).open("a")
    except OSError as error:
        raise not_writable(folder, error) from None
    with handle:
        try:
            fcntl.flock(handle.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise UsageError(
                "another bsip is writing there",
                file=folder,
                remedy="wait until it has ended, and run again",
            ) from None
        except OSError as error:
            raise not_writable(folder, error) from None
        remove_unfinished(folder)
        yield
