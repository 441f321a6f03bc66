"""A marker that sits elsewhere in one recording does not drag its place in the model there."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from bsip_cli.artifacts import read_artifact
from bsip_cli.simulate.options import Asked, StudyOptions
from bsip_cli.simulate.study import simulate_study
from tests.small_study import small

pytestmark = pytest.mark.long

MARKER, OFF_M = "LMALL", 0.03
PLACE = ["x_m", "y_m", "z_m"]


def options(*tasks: str) -> StudyOptions:
    """A person whose marker is off from the first frame on, in the recordings of these tasks."""
    asked = Asked("marker_shift", OFF_M, f"{MARKER},from_s=0")
    plain = small(static=1.0, sequence=10.0, squat=6.0)
    return replace(plain, effects=(asked,) if tasks else (), effect_tasks=tasks)


@pytest.fixture(scope="module")
def fitted(tmp_path_factory, bsip):
    @cache
    def fit(*tasks: str) -> Path:
        """Folder of the person, poses fitted."""
        root = tmp_path_factory.mktemp("-".join(("off", *tasks)))
        simulate_study(root / "study", options(*tasks))
        for stage in ("ingest", "scale", "ik"):
            bsip.done(stage, root / "study", "--out", root / "out", "--jobs", 1)
        return root / "out" / "sub-01"

    return fit


def place_of(folder: Path) -> np.ndarray:
    table = read_artifact(folder / "sub-01_marker-positions.parquet", "marker-positions")
    return table.loc[table["marker"] == MARKER, PLACE].to_numpy()[0]


def events_of(folder: Path, task: str) -> list[tuple[str, str]]:
    path = folder / f"sub-01_task-{task}_run-1_marker-events.parquet"
    found = read_artifact(path, "marker-events")
    return list(zip(found["kind"], found["marker"], strict=True))


def test_where_it_is_off_once_it_keeps_its_place(fitted):
    clean, off = fitted(), fitted("squat")
    assert np.linalg.norm(place_of(off) - place_of(clean)) < 0.002
    assert events_of(off, "squat") == [("offset", MARKER)]
    assert events_of(off, "sequence") == events_of(clean, "sequence") == []


def test_where_it_is_off_in_most_its_place_is_there(fitted):
    """Nobody can tell then where it belongs."""
    clean, off = fitted(), fitted("sequence", "squat")
    assert np.linalg.norm(place_of(off) - place_of(clean)) > 0.01
