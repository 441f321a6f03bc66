"""A stated mass against what the plates tell: agreement, a small difference, or a gross one."""

from __future__ import annotations

from dataclasses import dataclass

from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.told_mass import ToldMass

_PERCENT = 100.0
# What a mass in kg was taken for or from: the stated number over the mass in kg.
_UNITS = (
    ("pounds", 2.20462),
    ("stones", 1 / 6.35029),
    ("newton", 9.80665),
    ("grams", 1000.0),
    ("kilograms that were divided by 2.2046 once too often", 1 / 2.20462),
    ("kilograms that were divided by 9.81", 1 / 9.80665),
)
_CM_PER_M = 100.0
_NEAR_CM = 3.0


@dataclass(frozen=True)
class Comparison:
    """The stated mass, and known loads with it, beside what the plates tell of both."""

    stated_kg: float
    load_kg: float
    told: ToldMass
    tolerance_percent: float
    gross_percent: float
    height_m: float | None

    @property
    def difference_percent(self) -> float:
        return _PERCENT * (self.told.mass_kg / self.total_kg - 1.0)

    @property
    def total_kg(self) -> float:
        return self.stated_kg + self.load_kg

    @property
    def is_small(self) -> bool:
        """Within tolerance and interval; nothing is to be said."""
        allowed = self.tolerance_percent + self.told.half_width_percent
        return abs(self.difference_percent) <= allowed

    @property
    def is_gross(self) -> bool:
        """More than clothes, shoes and months make."""
        ratio = self.told.mass_kg / self.total_kg
        apart = _PERCENT * (max(ratio, 1.0 / ratio) - 1.0)
        return apart > self.gross_percent + self.told.half_width_percent

    def likely(self) -> str:
        """What the stated number is likely to be; empty if it is none of the known mistakes."""
        for name, factor in _UNITS:
            if self._meets(self.stated_kg / factor):
                return f"{self.stated_kg:g} is likely to be in {name}"
        height = self.height_m
        if height is not None and abs(self.stated_kg - _CM_PER_M * height) < _NEAR_CM:
            return f"{self.stated_kg:g} is likely to be the height in cm"
        turned = _digits_exchanged(self.stated_kg)
        if turned is not None and self._meets(turned):
            return f"{self.stated_kg:g} is likely to be {turned:g} with two digits exchanged"
        return ""

    def _meets(self, mass_kg: float) -> bool:
        allowed = self.tolerance_percent + self.told.half_width_percent
        return abs(_PERCENT * ((mass_kg + self.load_kg) / self.told.mass_kg - 1.0)) <= allowed

    def sentence(self, where: str) -> str:
        """Of a gross difference: both numbers, what is likely, what to do."""
        likely = self.likely() or (
            "a typing mistake, another person's row, a second person or a load on the plates"
        )
        return (
            f"the stated mass and the plates do not agree: {where} says {self.stated_kg:g} kg, "
            f"the plates tell {self.told.words()}; {likely}"
        )


def _digits_exchanged(number: float) -> float | None:
    """75.3 for 57.3; None if there are not two different leading digits."""
    whole = str(int(number))
    if len(whole) != 2 or whole[0] == whole[1]:
        return None
    return float(whole[::-1]) + number - int(number)


def mass_finding(told: ToldMass, comparison: Comparison | None, where: str) -> Finding:
    """The line for the quality table of a trial."""
    if not told.is_known:
        expected, action = "a mass that the plates tell for sure", "nothing compared"
        return Finding("plate_mass", "", f"not known: {told.reason}", expected, action, "info")
    if comparison is None:
        return Finding("plate_mass", "", told.words(), "no mass is stated", "", "info")
    expected = f"the stated {comparison.total_kg:.2f} kg within {comparison.tolerance_percent:g} %"
    if comparison.is_gross:
        action = "contacts found with the plates' mass"
        return Finding("mass", "", comparison.sentence(where), "", action, "warning")
    level = "info" if comparison.is_small else "warning"
    action = f"left both as they are ({comparison.difference_percent:+.1f} %)"
    return Finding("plate_mass", "", told.words(), expected, action, level)
