"""Which of the package's statements the short tests reach, by folder: ``make coverage``."""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from benchmarks.measure import RESULTS, markdown, write_csv

HEADER = ("folder", "statements", "reached_percent")


def by_folder(files: Mapping[str, Mapping]) -> list[tuple[str, int, float]]:
    """A row for each folder of the package, its own modules first, and one for all.

    files : of coverage's JSON report, path -> what was counted there.
    """
    statements: Counter[str] = Counter()
    reached: Counter[str] = Counter()
    for path, counted in files.items():
        folder = "/".join(Path(path).parts[:2]) if Path(path).parts[2:] else "bsip_cli"
        for key in (folder, "all"):
            statements[key] += counted["summary"]["num_statements"]
            reached[key] += counted["summary"]["covered_lines"]
    folders = [*sorted(statements.keys() - {"all"}), "all"]
    shares = {f: reached[f] / statements[f] if statements[f] else 1.0 for f in folders}
    return [(f, statements[f], round(100 * shares[f], 1)) for f in folders]


if __name__ == "__main__":
    rows = by_folder(json.loads(Path(sys.argv[1]).read_text())["files"])
    print(markdown(HEADER, rows))
    write_csv(RESULTS / "coverage.csv", HEADER, rows)
