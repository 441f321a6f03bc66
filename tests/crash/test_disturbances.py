"""A few disturbances of ``disturbances.py``, which makes a hundred: nothing is lost."""

from __future__ import annotations

import random

import pytest

from tests.crash.disturbances import Bench, disturb, killed, one_process_killed

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    folder = tmp_path_factory.mktemp("crash")
    (folder / "out").mkdir()
    return Bench(folder, random.Random(7), participants=1)


def test_disturbed_runs_lose_nothing(bench):
    hits = disturb(bench, (killed, one_process_killed), rounds=2)
    assert hits.total() == 2
    assert bench.faults == []


def test_what_is_not_whole_is_noticed(bench):
    name = "sub-01/sub-01_bsip.parquet"
    (bench.out / "sub-01").mkdir(exist_ok=True)
    (bench.out / name).write_bytes(bench.whole[name][:-100])
    bench.check_what_is_left("a cut artifact")
    assert any(name in fault for fault in bench.faults)
    bench.faults.clear()
