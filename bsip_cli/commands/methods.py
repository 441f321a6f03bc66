"""``bsip methods``: what was done with a study's data, as a paragraph to paste into a paper."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bsip_cli.artifacts import read_artifact, read_header
from bsip_cli.config import load_config
from bsip_cli.errors import UsageError
from bsip_cli.report.blocks import environment
from bsip_cli.report.causes import effect_title
from bsip_cli.report.records import flat
from bsip_cli.report.words import TEXTS, listing

_WITH_OPTIONS = ("wrench", "skeleton", "kinematics", "regression", "bsip", "fit")
_LATER = ("diagnosis", "joint-moments")  # may be missing: a user runs as many stages as needed
_NO_FAULT = ("none", "unexplained", "inconclusive")


def methods_text(out: Path) -> str:
    """The paragraph with its references, of the results in a folder, as they were made.

    UsageError: there are no identified parameters in it.
    BadDataError: an artifact cannot be read.
    """
    study = _Results(out)
    if not study.people:
        raise UsageError(
            "there are no identified parameters",
            file=out,
            remedy="run `bsip run` first, or name the folder that it was given with --out",
        )
    text = environment().get_template("methods.txt.j2").render(study=study)
    paragraphs = (" ".join(part.split()) for part in text.split("\n\n"))
    return "\n\n".join(part for part in paragraphs if part)


class _Results:
    """What the artifacts of a folder say of how they were made."""

    def __init__(self, out: Path) -> None:
        self.people = sorted(path.parent for path in out.glob("sub-*/sub-*_bsip.parquet"))
        self.cited: list[str] = []

    def cite(self, *keys: str) -> str:
        """``[2, 3]``, counted in the order in which they are first cited."""
        self.cited += [key for key in keys if key not in self.cited]
        return f"[{', '.join(str(self.cited.index(key) + 1) for key in keys)}]"

    def references(self) -> list[str]:
        return [f"[{n}] {TEXTS['references'][key]}." for n, key in enumerate(self.cited, start=1)]

    def _files(self, kind: str) -> Iterator[Path]:
        for folder in self.people:
            yield from sorted(folder.glob(f"*_{kind}.parquet"))

    def _tables(self, kind: str) -> Iterator[pd.DataFrame]:
        return (read_artifact(path, kind) for path in self._files(kind))

    def has(self, kind: str) -> bool:
        return any(True for _ in self._files(kind))

    @cached_property
    def _made(self) -> list[Mapping[str, Any]]:
        kinds = (*_WITH_OPTIONS, *_LATER)
        files = (path for kind in kinds for path in self._files(kind))
        return [read_header(path)["provenance"]["made_by"] for path in files]

    @cached_property
    def _options(self) -> dict[str, list[Any]]:
        """By name, the values with which the artifacts were made; more than one if they differ."""
        found: dict[str, dict[str, Any]] = {}
        for made in self._made:
            known = {name: x for name, x in made["options"].items() if name != "participant"}
            for name, value in flat(known):
                found.setdefault(name, {})[json.dumps(value)] = value
        return {name: list(values.values()) for name, values in found.items()}

    def option(self, name: str) -> Any:
        """Of the first artifact; `differing` names those of which there are more."""
        return self._options[name][0]

    def differing(self) -> list[str]:
        return sorted(name for name, values in self._options.items() if len(values) > 1)

    def changed(self) -> list[str]:
        """``name = value`` of options other than the defaults."""
        defaults = dict(flat(load_config([]).model_dump(mode="json")))
        return [
            f"{name} = {json.dumps(values[0])}"
            for name, values in sorted(self._options.items())
            if name in defaults and values[0] != defaults[name]
        ]

    def versions(self) -> str:
        """One for each bsip and code that made any of it."""
        made = sorted({made["bsip_version"] for made in self._made})
        libraries = self._made[0]["libraries"]
        named = {"pin": "Pinocchio", "ezc3d": "ezc3d", "numpy": "NumPy", "scipy": "SciPy"}
        others = listing([f"{title} {libraries[name]}" for name, title in named.items()])
        return f"{listing(made)} (with {others})"

    # --- people and recordings ----------------------------------------------------------------

    @cached_property
    def persons(self) -> pd.DataFrame:
        return pd.concat(self._tables("person"), ignore_index=True)

    def sexes(self) -> str:
        counts = Counter(self.persons["sex"])
        titles = {"M": "male", "F": "female", "other": "of other or unknown sex"}
        return listing([f"{n} {titles.get(sex, sex)}" for sex, n in sorted(counts.items())])

    def spread(self, column: str, digits: int) -> str:
        """Mean and standard deviation over persons; of one person the value."""
        values = self.persons[column].dropna()
        if values.empty:
            return "not known"
        if len(values) == 1:
            return f"{values.iloc[0]:.{digits}f}"
        return f"{values.mean():.{digits}f} ± {values.std():.{digits}f}"

    def trials(self) -> str:
        """How many of which task."""
        tasks = Counter(
            path.name.split("_task-")[1].split("_")[0] for path in self._files("wrench")
        )
        return listing([f"{n} of {task}" for task, n in sorted(tasks.items())])

    def marker_sets(self) -> str:
        found = (read_header(path)["provenance"]["facts"] for path in self._files("person"))
        return listing(sorted({facts["marker_set"] for facts in found}))

    def rates(self) -> str:
        times = (table["time_s"] for table in self._tables("kinematics"))
        found = {round(1.0 / float(np.median(np.diff(one))), 1) for one in times}
        return listing([f"{rate:g}" for rate in sorted(found)])

    # --- what came of it ----------------------------------------------------------------------

    @cached_property
    def identified(self) -> pd.DataFrame:
        table = pd.concat(self._tables("identification"), ignore_index=True)
        return table[table["method"] == "OM"]

    def chosen(self) -> str:
        """For how many persons which parameters are to be used; empty before ``choose``."""
        uses = Counter(table["use"].iloc[0] for table in self._tables("choice"))
        return listing([f"{use} for {n}" for use, n in sorted(uses.items())], empty="")

    def causes(self) -> str:
        """Named causes and in how many persons."""
        found: Counter[str] = Counter()
        for folder in self.people:
            path = folder / f"{folder.name}_diagnosis.parquet"
            if path.exists():
                table = read_artifact(path, "overall-diagnosis")
                named = table.loc[table["verdict"] == "named", "effect"]
                found.update(set(named) - set(_NO_FAULT))
        return listing([f"{effect_title(effect)} ({n})" for effect, n in found.most_common()], "")
