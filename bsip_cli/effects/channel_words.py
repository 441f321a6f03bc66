"""The channels of plates and the components of the ground wrench as people say them."""

from __future__ import annotations

OF_A_PLATE = {
    "fx": "the horizontal force along the plate's x axis",
    "fy": "the horizontal force along the plate's y axis",
    "fz": "the vertical force",
    "mx": "the moment about the plate's x axis",
    "my": "the moment about the plate's y axis",
    "mz": "the moment about the vertical",
}
OF_THE_LAB = {
    "fx": "the horizontal force along the lab's X axis",
    "fy": "the horizontal force along the lab's Y axis",
    "fz": "the vertical force",
    "mx": "the moment about the lab's X axis",
    "my": "the moment about the lab's Y axis",
    "mz": "the moment about the vertical",
}


def unit_of(channel: str) -> str:
    """``N`` of a force, ``N m`` of a moment."""
    return "N" if channel.startswith("f") else "N m"
