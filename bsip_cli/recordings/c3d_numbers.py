"""How the processor that wrote a C3D file stored its integers and floats."""

from __future__ import annotations

import numpy as np

PC, DEC, MIPS = 84, 85, 86  # the last is refused: ezc3d knows no such numbers


def integers(raw: bytes) -> np.ndarray:
    """Signed 16-bit integers."""
    return np.frombuffer(raw, "<i2").astype(np.int16)


def floats(raw: bytes, processor: int) -> np.ndarray:
    """32-bit floats, IEEE or those of a VAX, as float64."""
    with np.errstate(invalid="ignore"):  # bits of a signalling NaN
        if processor == DEC:
            return _vax(np.frombuffer(raw, "<u2"))
        return np.frombuffer(raw, "<f4").astype(float)


def _vax(words: np.ndarray) -> np.ndarray:
    """VAX F floats: the high word comes first and the exponent is larger by two."""
    high, low = words[0::2].astype(np.uint32), words[1::2].astype(np.uint32)
    values = ((high << 16) | low).view(np.float32).astype(float) / 4
    values[(high & 0x7F80) == 0] = 0.0
    return values
