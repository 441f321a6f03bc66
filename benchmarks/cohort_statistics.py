"""Time and memory of the group's stages over thousands of participants' artifacts.

    python -m benchmarks.cohort_statistics [--participants 100 1000 10000]

One simulated person is run through the pipeline; every participant gets that person's artifacts
with other numbers and names. ``bsip run --group`` then has the work of a cohort of that size.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq

from benchmarks.measure import bsip, machine, markdown
from benchmarks.participant import study_options
from bsip_cli.artifacts import read_artifact, read_header, write_artifact
from bsip_cli.pipeline import STAGES
from bsip_cli.simulate.study import simulate_study

SPREAD = 0.05  # of a number over the participants, of itself
AS_IT_IS = "laboratory-information"  # its numbers are a matrix that is no precision any more
SEED = 1


def another(
    table: pd.DataFrame, spread: float, old: str, new: str, rng: np.random.Generator
) -> pd.DataFrame:
    """The table with every number a little other, and of another participant."""
    numbers = table.select_dtypes("floating")
    factors = 1.0 + spread * rng.standard_normal(numbers.shape)
    words = {
        name: text.str.replace(old, new) for name, text in table.items() if text.dtype == "str"
    }
    return table.assign(**(numbers * factors), **words)


def make_cohort(model: Path, folder: Path, n: int) -> None:
    """A study of ``n`` participants, after the one of ``model``, with the artifacts that the stages
    of the group read."""
    rng = np.random.default_rng(SEED)
    (one,) = (path.name for path in (model / "study").glob("sub-*"))
    recordings = [path.name for path in (model / "study" / one).iterdir()]
    read = {kind for stage in STAGES if stage.level == "cohort" for kind in stage.inputs}
    paths = sorted((model / "out" / one).glob("*.parquet"))
    headers = {path: read_header(path) for path in paths}
    artifacts = {
        path.name: (header["kind"], read_artifact(path, header["kind"]), header["provenance"])
        for path, header in headers.items()
        if header["kind"] in read
    }
    rows = ["participant_id\tsex\tmass_kg\theight_m"]
    for k in range(n):
        name = f"sub-{k + 1:05d}"
        rows.append(f"{name}\tM\t70\t1.80")
        for place in ("study", "out"):
            (folder / place / name).mkdir(parents=True)
        for recording in recordings:
            (folder / "study" / name / recording.replace(one, name)).touch()
        for file, (kind, table, provenance) in artifacts.items():
            path = folder / "out" / name / file.replace(one, name)
            spread = 0.0 if kind == AS_IT_IS else SPREAD
            write_artifact(path, kind, another(table, spread, one, name, rng), provenance)
    (folder / "study" / "participants.tsv").write_text("\n".join(rows) + "\n")
    toml = model / "study" / "study.toml"
    (folder / "study" / "study.toml").write_bytes(toml.read_bytes())


def measured(folder: Path) -> tuple[float, float, float]:
    """CPU-seconds, seconds of the clock and MB of the group's stages."""
    began = time.monotonic()
    usage = bsip("run", folder / "study", "--group", "--out", folder / "out")
    return usage.cpu_s, time.monotonic() - began, usage.peak_mb


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--participants", type=int, nargs="+", default=[100, 1000, 10000])
    parser.add_argument("--sequence-s", type=float, default=30.0)
    arguments = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as name:
        model = Path(name) / "model"
        simulate_study(model / "study", study_options(arguments.sequence_s, SEED))
        bsip("run", model / "study", "--out", model / "out")
        for n in arguments.participants:
            folder = Path(name) / str(n)
            make_cohort(model, folder, n)
            cpu_s, clock_s, peak_mb = measured(folder)
            values = pq.read_metadata(folder / "out" / "group" / "group_values.parquet").num_rows
            rows.append(
                [f"{n:,}", f"{values:,}", f"{cpu_s:.0f}", f"{clock_s:.0f}", f"{peak_mb:.0f}"]
            )
            print(rows[-1], file=sys.stderr)
    print(machine())
    head = ["participants", "rows of values", "CPU-s", "s of the clock", "peak memory [MB]"]
    print(markdown(head, rows))


if __name__ == "__main__":
    main()
