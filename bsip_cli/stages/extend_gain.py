"""extend (participant, gain): what the extended model gains over all trials that it concerns."""

from __future__ import annotations

from zlib import crc32

import numpy as np

from bsip_cli.report.verdict import gain_sentence
from bsip_cli.running.unit import Unit
from bsip_cli.stages.reconstruct import gain_rows
from bsip_cli.statistics.choice import BlockErrors, pooled


def run(unit: Unit) -> None:
    """Read the trials' gains with their sums per block; write the person's."""
    facts = {trial.stem: unit.facts("gain", trial) for trial in unit.trials("gain")}
    concerned = {stem: one for stem, one in facts.items() if one}
    if not concerned:
        unit.write("overall-gain", ())
        return
    errors = {}
    for component in next(iter(concerned.values()))["blocks"]:
        sums = [one["blocks"][component].items() for one in concerned.values()]
        each = [BlockErrors(**{name: np.array(x) for name, x in one}) for one in sums]
        errors[component] = pooled(each)
    methods = dict.fromkeys(one["method"] for one in concerned.values())
    seed = crc32(unit.name.encode())
    data = "; ".join(
        f"{kind}: {', '.join(stem for stem, one in concerned.items() if one['data'] == kind)}"
        for kind in dict.fromkeys(one["data"] for one in concerned.values())
    )  # held_out: a, b; identification: c
    rows = gain_rows(errors, ", ".join(methods), data, seed)
    unit.write("overall-gain", rows)
    unit.say(gain_sentence(rows) or "no error could be compared")
