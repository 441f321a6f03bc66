"""What ``bsip show`` prints of a finished run: tables, diagnoses in words, where reports lie."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from bsip_cli.artifacts import read_artifact
from bsip_cli.report.diagnosis import verdict_words
from bsip_cli.report.tables.build import show as tables_of
from bsip_cli.schemas import SCHEMAS

_KINDS, _GAIN = ("overall-diagnosis", "detection"), "overall-gain"


def shown(out: Path) -> Iterator[str]:
    """The parts of the answer, in order.

    Raises
    ------
    UsageError
        No tables have been written there.
    BadDataError
        A diagnosis cannot be read.
    """
    yield tables_of(out)
    for folder in sorted(path for path in out.glob("sub-*") if path.is_dir()):
        diagnosis, detection = (_path(folder, kind) for kind in _KINDS)
        if diagnosis.exists() and detection.exists():
            yield "\n".join([f"## Is anything wrong: {folder.name}", *_verdict(folder)])
    for report in (out / "group" / "report.html", *sorted(out.glob("sub-*/report.html"))):
        if report.exists():
            yield f"report: {report}"


def _path(folder: Path, kind: str) -> Path:
    return folder / f"{folder.name}_{SCHEMAS[kind].file_name}.parquet"


def _verdict(folder: Path) -> tuple[str, ...]:
    diagnosis, detection = (read_artifact(_path(folder, kind), kind) for kind in _KINDS)
    gain = _path(folder, _GAIN)
    return verdict_words(
        diagnosis, detection, read_artifact(gain, _GAIN) if gain.exists() else None
    )
