"""What is said of how the recordings of a session were understood: once for all trials, and of one
trial where it stands alone."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from bsip_cli.recordings.model import Finding, Recording
from bsip_cli.recordings.plate_reading import AS_STATED, FrameChange
from bsip_cli.recordings.scene import crossed_limbs, handedness
from bsip_cli.recordings.session_reading import AGAINST, SessionReading, Verdict
from bsip_cli.recordings.shared_forces import ALIKE_M
from bsip_cli.recordings.trial_samples import LEAST_S
from bsip_cli.recordings.under_the_feet import BESIDE_M, Evidence
from bsip_cli.recordings.written import Written, force_unit_words

_TRIED = (
    "other units, other points that moments are about, corners in another order, reversed and "
    "exchanged channels, other axes and another plate's place were tried, and none explains it"
)
_LOOK_AT = {
    False: "Look first whether the plate stands where its corners say: in the markers' frame, "
    "calibrated in the same session, not moved since, and whether anything else stood on it",
    True: "Look first whether these are the forces of this trial and of this person alone, on one "
    "clock with the markers, and whether the labels are those of the markers",
}
_DRIVES = "one that moves the body as the markers do"


def about_own_units(units: tuple[float, float] | None) -> list[Finding]:
    """Of a trial's moments and points that are in other units than the session's."""
    if units is None:
        return []
    found = "the moments or points of force are not in the unit of the session's other trials"
    words = AS_STATED.in_units(*units).words() or "took them as they stand"
    action, expected = f"{words}, in this trial alone; export all in one unit", "one unit"
    return [Finding("unit", "forces", found, expected, action, "corrected")]


def findings_about(session: SessionReading) -> list[Finding]:
    """What was decided for all trials of a session alike."""
    plates = (_about_plate(name, verdict) for name, verdict in session.plates.items())
    found = (finding for found in plates for finding in found)
    doubts = _about_those_against(session.against)
    return [*_about_written(session.written), *_about_frame(session.frame), *found, *doubts]


def _about_written(written: Written) -> list[Finding]:
    findings = []
    if written.force_N != 1.0:
        found, expected = "in N the forces would carry nobody of this size", "forces in N"
        action = f"read forces and moments {force_unit_words(written.force_N)}, in all trials; "
        action += "export them in N"
        findings.append(Finding("unit", "forces", found, expected, action, "corrected"))
    rates = {"cameras": written.pace, "forces": written.force_pace}
    for (whose, pace), other in zip(rates.items(), reversed(rates), strict=True):
        if pace != 1.0:
            lasting = pace if whose == "cameras" else 1 / pace
            found = f"the markers last {lasting:.4g} times as long as the forces"
            expected, level = "one time of markers and forces", "corrected"
            action = f"took the rate of the {whose} as {pace:.4g} times the stated one, in all "
            action += "trials; correct it in the files"
            if written.probability < 1.0:
                level = "warning"
                action += f" (p = {written.probability:.2f}; else that of the {other} is wrong)"
            findings.append(Finding("rate", whose, found, expected, action, level))
    return findings


def _about_those_against(trials: Collection[str]) -> list[Finding]:
    """Of the forces that are believed although as many trials contradict them."""
    if not trials:
        return []
    found = "as many trials contradict how the plates are understood as agree with it: in "
    found += f"{', '.join(trials)} no reading of them makes forces and motion one person's"
    action = "kept the forces of the others, whose sizes and points of force may be wrong too; "
    action += "look at the channels and corners of the plates"
    return [Finding("plate_cop", "forces", found, "one reading of all trials", action, "warning")]


def _about_frame(frame: FrameChange) -> list[Finding]:
    if not frame.moved:
        return []
    check, expected, level = "mirrored", "a right-handed frame", "corrected"
    found = "left and right are exchanged all over the body: a left-handed laboratory frame"
    more = "; if instead left and right labels are exchanged, rename them"
    if frame.moved == "forces":
        check, expected, more = "frame", "markers and forces in one frame", ""
        found = "the forces lie under the feet and go with the motion in another frame only"
        if frame.unsure_m > ALIKE_M:
            more = f": centres of pressure may be off by {1e3 * frame.unsure_m:.0f} mm; if you "
            more, level = f"{more}know how the plates lie, correct their corners", "warning"
    return [Finding(check, "", found, expected, f"{frame.words()}, in all trials{more}", level)]


def delay_words(delay_s: float) -> str:
    """Empty if there is none."""
    when = "later" if delay_s > 0 else "earlier"
    words = f"the forces come {abs(delay_s):.2f} s {when} than the motion that they drive"
    return words if delay_s else ""


def other_pace(times: float, rate_hz: float) -> str:
    """Empty if it is 1."""
    if times == 1.0:
        return ""
    how, much = ("fast", times) if times > 1 else ("slowly", 1 / times)
    return (
        f"the body moves about {much:.2g} times as {how} as at the stated {rate_hz:g} Hz: forces "
        f"and accelerations agree at about {times * rate_hz:.3g} Hz; correct the rate of the "
        "cameras in the file"
    )


def about_delay(own_s: float, delays_s: Mapping[str, float]) -> list[Finding]:
    """Of the trial, or of another one: a quiet trial does not show it of itself."""
    expected = "one clock of markers and forces"
    if own_s:
        said = [delay_words(own_s)]
        action = f"moved them by that, which is known to about {LEAST_S:g} s; start markers and "
        action += "forces by one signal, and make sure that they are not those of another trial"
    else:
        said = [f"in {name} {delay_words(delay_s)}" for name, delay_s in delays_s.items()]
        action = "none shows here, took the times as they stand; look whether the same delay is "
        action += "here too"
    return [Finding("delay", "forces", one, expected, action, "warning") for one in said[:1]]


def about_drift(drift_s: float) -> list[Finding]:
    """Of forces that come so much later at the end of a trial than at its start."""
    if not drift_s:
        return []
    way = "behind" if drift_s > 0 else "ahead"
    found = f"forces and motion drift apart: at the end the forces are about {abs(drift_s):.1f} s "
    found += f"further {way} than at the start"
    action = "took the times as they stand; look whether the forces' rate is right, and whether "
    action += "rows of them were lost and the rest was numbered without gaps"
    expected = "one clock of markers and forces"
    return [Finding("delay", "forces", found, expected, action, "warning")]


def _about_plate(name: str, verdict: Verdict) -> list[Finding]:
    if verdict.repeats:
        whose = " and ".join(verdict.repeats)
        found = f"its force is that of plate {whose}"
        found += " together" if len(verdict.repeats) > 1 else ""
        action = "left it out, so that no force counts twice"
        expected = "plates that measure different feet"
        return [Finding("plate_repeated", name, found, expected, action, "corrected")]
    if verdict.refusal:
        action = f"left the plate out: {_TRIED}. {_LOOK_AT[verdict.refusal == AGAINST]}"
        if verdict.alternatives:
            action = (
                f"left the plate out: {' or '.join(verdict.alternatives)}: these trials do not "
                "show which; one "
                f"with more movement might. {_LOOK_AT[False]}"
            )
        return [about_place(name, verdict.refusal, action, "excluded")]
    reading, findings = verdict.reading, []
    if verdict.gain != 1.0:
        found = f"while it bears the person alone, it reads {verdict.gain:.4g} times the weight "
        found += "on which at least two others, plates or the stated mass, agree"
        action = (
            f"divided its forces and moments by {verdict.gain:.4g}, in all trials; correct its "
        )
        action += "gain or its range in the files"
        expected = "one weight on every plate"
        findings.append(Finding("plate_force", name, found, expected, action, "corrected"))
    if verdict.doubted:
        is_moment = verdict.doubted == "vertical moment"
        found = f"its {verdict.doubted}: {' or '.join(verdict.alternatives)}: these trials do not "
        found += "show which"
        action = "took it as it stands; a movement that "
        action += f"{'turns the body' if is_moment else 'pushes the body more'} would show it"
        check = "plate_moment" if is_moment else "plate_force"
        findings.append(Finding(check, name, found, _DRIVES, action, "warning"))
    if words := reading.words():
        assert verdict.before is not None and verdict.after is not None
        before, after = _words(verdict.before), _words(verdict.after)
        if before and after and _are_alike(verdict.before, verdict.after):
            found = "as it stands, it does not drive the body as the markers move"
            findings.append(Finding("plate_force", name, found, _DRIVES, words, "corrected"))
        elif before:  # of a plate that nobody loads nothing is corrected
            action = f"{words}: {after}" if after else f"{words}, as of the other plates"
            findings.append(about_place(name, before, action, "corrected"))
    if reading.half_size_m is not None:
        sides = " x ".join(f"{2 * half:.2f}" for half in reading.half_size_m)
        found = "its load lies beside its outline and under a foot"
        findings.append(about_place(name, found, f"widened the outline to {sides} m", "corrected"))
    return findings


def about_sides(recording: Recording) -> list[Finding]:
    """Parts of the body that have left and right exchanged, or one of their ends."""
    found = "left and right markers are on the wrong sides, and not all over the body"
    crossed = "left and right are exchanged at one end, which moves with the other side's"
    action = "left them as they are; correct the labels"
    return [
        Finding("labels", part, found, "left on the left", action, "warning")
        for part in handedness(recording.labels, recording.markers_m).exchanged()
    ] + [
        Finding("labels", limb, crossed, "ends of one segment", action, "warning")
        for limb in crossed_limbs(recording.labels, recording.markers_m)
    ]


def about_place(name: str, found: str, action: str, level: str) -> Finding:
    """Of where a plate's force lies."""
    expected = f"under the foot that stands on it, to {BESIDE_M:g} m"
    return Finding("plate_cop", name, found, expected, action, level)


def _are_alike(before: Evidence, after: Evidence) -> bool:
    """Whether both put the force at one place, to half a centimetre: it was not wrong there."""
    one, other = ((x.distance_m, x.outside_m, x.sway_m) for x in (before, after))
    return bool(np.allclose(one, other, rtol=0.0, atol=0.005, equal_nan=True))


def _words(evidence: Evidence) -> str:
    """Where a reading puts the force; empty if there is none."""
    if np.isfinite(evidence.distance_m):
        place = f"{evidence.distance_m:.2f} m beside the feet on the ground"
    elif np.isfinite(evidence.outside_m):
        place = f"{evidence.outside_m:.2f} m outside the plate"
    else:
        return ""
    return f"centre of pressure {place}, moving by {1e3 * evidence.sway_m:.3g} mm"
