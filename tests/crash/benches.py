"""The benches whose calls fail: cheap stages, with all that is upstream of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from tests.crash.bench import Bench, Run, make_study

UPSTREAM = {"ingest": (), "regress": ("ingest", "scale")}


def benches(run: Run, folder: Path, names: Sequence[str]) -> Iterator[Bench]:
    """Each stage where its results are not there yet, and where they are and are made again."""
    study = make_study(folder / "study", participants=1)
    for name in names:
        before = folder / f"before_{name}"
        for stage in UPSTREAM[name]:
            run(study, before, (stage,), {})
        yield Bench.of(run, study, before, name)
        yield Bench.of(run, study, before.with_name(f"{before.name}_whole_{name}"), name, "--force")
