"""The units and digits in which people read the sizes of effects."""

from __future__ import annotations

_SCALES = {"rad": (57.29577951308232, "°"), "m": (1000.0, "mm")}
_PLAIN_NUMBERS = ("damping_ratio",)


def readable_unit(parameter: str, unit: str) -> tuple[float, str]:
    """Factor and unit in which people read a parameter."""
    if parameter == "delay":
        return 1000.0, "ms"
    if parameter == "rate_error":
        return 1e6, "ppm"
    if unit == "1":
        return (1.0, "") if parameter in _PLAIN_NUMBERS else (100.0, "%")
    return _SCALES.get(unit, (1.0, unit))


def with_unit(text: str, unit: str) -> str:
    """``2.5 ms``, ``1.3°``, or a number alone."""
    return f"{text}{'' if unit == '°' else ' '}{unit}".strip()


def digits_of(width: float) -> int:
    """Decimals that leave two digits of a number of this size."""
    if not abs(width) > 0:
        return 1
    exponent = int(f"{abs(width):e}".split("e")[1])
    return max(0, 1 - exponent)
