"""Ways to damage a file, drawn from a seed: flipped, cut, emptied, moved bytes and mangled text."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

_EXTREME_WORDS = (0, 1, 2, 0x7F, 0xFF, 0x100, 0x7FFF, 0x8000, 0xFFFE, 0xFFFF)
_ODD_TEXTS = (
    "nan",
    "inf",
    "-1e308",
    "1e309",
    "99999999999999",
    "-",
    ",",
    "\0",
    "\ufeff",
    "''",
    "0x1",
)
_BLOCK = 512

Damage = Callable[[bytes, int, np.random.Generator], bytes]


def flip_bytes(content: bytes, head: int, rng: np.random.Generator) -> bytes:
    """One to eight bytes anywhere."""
    return _flipped(content, len(content), rng)


def flip_head(content: bytes, head: int, rng: np.random.Generator) -> bytes:
    """One to eight bytes of what describes the data."""
    return _flipped(content, head, rng)


def set_word(content: bytes, head: int, rng: np.random.Generator) -> bytes:
    """An extreme 16-bit word in what describes the data."""
    at = 2 * int(rng.integers(max(head // 2, 1)))
    word = int(rng.choice(_EXTREME_WORDS)).to_bytes(2, "little")
    return content[:at] + word + content[at + 2 :]


def cut_end(content: bytes, head: int, rng: np.random.Generator) -> bytes:
    return content[: int(rng.integers(len(content)))]


def empty_block(content: bytes, head: int, rng: np.random.Generator) -> bytes:
    """512 bytes of zero."""
    at = _BLOCK * int(rng.integers(max(1, len(content) // _BLOCK)))
    return content[:at] + bytes(len(content[at : at + _BLOCK])) + content[at + _BLOCK :]


def move_bytes(content: bytes, head: int, rng: np.random.Generator) -> bytes:
    """Bytes put in or taken out, so that everything behind them moves."""
    at, n = int(rng.integers(len(content))), int(rng.integers(1, 16))
    if rng.random() < 0.5:
        return content[:at] + content[at + n :]
    return content[:at] + rng.bytes(n) + content[at:]


def change_cell(content: bytes, head: int, rng: np.random.Generator) -> bytes:
    """One word of a text becomes something odd."""
    cells = content.split(b"\t")
    cells[int(rng.integers(len(cells)))] = str(rng.choice(_ODD_TEXTS)).encode()
    return b"\t".join(cells)


def change_line(content: bytes, head: int, rng: np.random.Generator) -> bytes:
    """A line of a text is lost, doubled, cut or exchanged with another."""
    lines = content.split(b"\n")
    at, other = (int(i) for i in rng.integers(len(lines), size=2))
    kind = rng.integers(4)
    if kind == 0:
        del lines[at]
    elif kind == 1:
        lines.insert(at, lines[at])
    elif kind == 2:
        lines[at] = lines[at][: int(rng.integers(len(lines[at]) + 1))]
    else:
        lines[at], lines[other] = lines[other], lines[at]
    return b"\n".join(lines)


def change_separator(content: bytes, head: int, rng: np.random.Generator) -> bytes:
    """Another separator or line end throughout, as editors and locales make them."""
    old, new = [(b"\t", b" "), (b"\t", b","), (b"\n", b"\r"), (b".", b","), (b"\n", b"\r\n")][
        int(rng.integers(5))
    ]
    return content.replace(old, new)


def _flipped(content: bytes, reach: int, rng: np.random.Generator) -> bytes:
    damaged = bytearray(content)
    for at in rng.integers(max(reach, 1), size=int(rng.integers(1, 9))):
        damaged[at] ^= int(rng.integers(1, 256))
    return bytes(damaged)


BINARY: tuple[Damage, ...] = (
    flip_bytes,
    flip_head,
    flip_head,
    set_word,
    cut_end,
    empty_block,
    move_bytes,
)
TEXT: tuple[Damage, ...] = (
    flip_bytes,
    flip_head,
    cut_end,
    move_bytes,
    change_cell,
    change_line,
    change_separator,
)
