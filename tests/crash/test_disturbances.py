"""A few disturbances of ``disturbances.py``, which makes a hundred: nothing is lost."""

from __future__ import annotations

import random

import pytest
from disturbances import ANYWHERE, Bench, disturb, killed

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    folder = tmp_path_factory.mktemp("crash")
    (folder / "out").mkdir()
    return Bench(folder, random.Random(7), participants=1)


def test_disturbed_runs_lose_nothing(bench):
    hits = disturb(bench, (killed, *ANYWHERE), rounds=4)
    assert hits.total() == 4
    assert bench.faults == []


def test_what_is_not_whole_is_noticed(bench):
    bench.run()
    path = bench.out / "sub-01" / "sub-01_bsip.parquet"
    path.write_bytes(path.read_bytes()[:-100])
    bench.check_what_is_left("a cut artifact")
    assert any("sub-01_bsip.parquet" in fault for fault in bench.faults)
