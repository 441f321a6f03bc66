"""Error of the reconstructed wrench on unseen data with each way to smooth the motion.

    python -m benchmarks.smoothers STUDY [STUDY ...]

Each study is run with the penalised spline and with Butterworth filters of 6 and 10 Hz; printed
are mean RMSE of OM over the trials (static ones aside) that did not identify it.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import pandas as pd

from benchmarks.measure import bsip, markdown

SMOOTHERS = {
    "spline": 'method = "spline"',
    "Butterworth 6 Hz": 'method = "butterworth"\nbutterworth_cutoff_hz = 6.0',
    "Butterworth 10 Hz": 'method = "butterworth"\nbutterworth_cutoff_hz = 10.0',
}
_COMPONENTS = ["fx", "fy", "fz", "mx", "my", "mz", "cop_ap", "cop_ml"]
_ONCE = ("ingest", "scale")
_EACH = ("ik", "regress", "identify", "reconstruct")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("studies", type=Path, nargs="+")
    for study in parser.parse_args().studies:
        print(f"\n**{study.name}**: RMSE of OM on unseen data (N, N m, mm)\n")
        rows = [[name, *map("{:.1f}".format, errors)] for name, errors in compare(study).items()]
        print(markdown(["smoother", *_COMPONENTS], rows))


def compare(study: Path) -> dict[str, pd.Series]:
    """Mean held-out RMSE per component for each smoother."""
    found = {}
    with tempfile.TemporaryDirectory() as scratch:
        out, options = Path(scratch) / "out", Path(scratch) / "options.toml"
        options.write_text("")
        run(study, out, options, _ONCE)
        for name, lines in SMOOTHERS.items():
            options.write_text(f"[smoothing]\n{lines}\n")
            run(study, out, options, _EACH)
            found[name] = held_out(out)
    return found


def run(study: Path, out: Path, options: Path, stages: tuple[str, ...]) -> None:
    for stage in stages:
        bsip(stage, study, "--out", out, "--config", options, "--jobs", 2)


def held_out(out: Path) -> pd.Series:
    tables = [
        pd.read_parquet(path)
        for path in sorted(out.glob("sub-*/*_fit.parquet"))
        if "task-static" not in path.name
    ]
    joined = pd.concat(tables)
    unseen = joined[(joined["data"] == "held_out") & (joined["method"] == "OM")]
    return unseen.groupby("component")["rmse"].mean()[_COMPONENTS]


if __name__ == "__main__":
    main()
