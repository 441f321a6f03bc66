"""The benchmarks' modules are scripts: their folder is on the path, and that of the writers."""

import sys
from pathlib import Path

_ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(_ROOT / "benchmarks"), str(_ROOT / "tests" / "recordings")]
