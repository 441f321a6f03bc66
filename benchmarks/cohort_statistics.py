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
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from benchmarks.measure import bsip, machine, markdown
from benchmarks.participant import study_options
from bsip_cli.pipeline import STAGES
from bsip_cli.schemas import SCHEMAS
from bsip_cli.simulate.study import simulate_study

SPREAD = 0.05  # of a number over the participants, of itself
SEED = 1


def read_by_the_group() -> set[str]:
    """Names of the artifacts of one participant or trial that the stages of the group read."""
    kinds = {kind for stage in STAGES if stage.level == "cohort" for kind in stage.inputs}
    return {SCHEMAS[kind].file_name for kind in kinds if SCHEMAS[kind].level != "cohort"}


def another(table: pa.Table, old: str, new: str, rng: np.random.Generator) -> pa.Table:
    """The table with every number a little other, and of another participant."""
    for k, field in enumerate(table.schema):
        column = table.column(k)
        if pa.types.is_floating(field.type):
            factors = 1.0 + SPREAD * rng.standard_normal(len(table))
            table = table.set_column(k, field, pc.multiply(column, pa.array(factors)))
        elif pa.types.is_string(field.type):
            table = table.set_column(k, field, pc.replace_substring(column, old, new))
    return table


def make_cohort(model: Path, folder: Path, n: int) -> None:
    """A study of ``n`` participants and their artifacts, after the one of ``model``."""
    rng = np.random.default_rng(SEED)
    (one,) = (path.name for path in (model / "study").glob("sub-*"))
    recordings = [path.name for path in (model / "study" / one).iterdir()]
    artifacts = {
        path.name: pq.read_table(path)
        for path in sorted((model / "out" / one).glob("*.parquet"))
        if path.stem.split("_")[-1] in read_by_the_group()
    }
    rows = ["participant_id\tsex\tmass_kg\theight_m"]
    for k in range(n):
        name = f"sub-{k + 1:05d}"
        rows.append(f"{name}\tM\t70\t1.80")
        for place in ("study", "out"):
            (folder / place / name).mkdir(parents=True)
        for recording in recordings:
            (folder / "study" / name / recording.replace(one, name)).touch()
        for file, table in artifacts.items():
            path = folder / "out" / name / file.replace(one, name)
            pq.write_table(another(table, one, name, rng), path, write_page_checksum=True)
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
