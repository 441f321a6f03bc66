"""The notebook runs from its first cell to its last, and finds what it hides."""

from __future__ import annotations

import json
from pathlib import Path

import matplotlib as mpl
import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOK = ROOT / "docs" / "library.ipynb"


@pytest.mark.long
def test_the_notebook_names_the_delay(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    mpl.use("Agg")
    cells = json.loads(NOTEBOOK.read_text())["cells"]
    known: dict = {}
    for cell in cells:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), known)
    named = known["named"]
    assert set(named["effect"]) == {"sync_offset"}
    delay = named.iloc[0]
    assert delay["ci_low"] <= 0.020 <= delay["ci_high"], delay["sentence"]
    assert {"OM", "OM+sync_offset"} <= set(known["hip"]["method"])
    assert delay["sentence"] in capsys.readouterr().out
    assert known["urdf"].startswith("<?xml")
