"""The noisy trials of tests/diagnosis, and the scenes they are made of, serve here too."""

import sys
from pathlib import Path

for _folder in ("body", "effects", "diagnosis"):
    sys.path.insert(0, str(Path(__file__).parents[1] / _folder))
