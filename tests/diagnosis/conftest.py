"""The moving person of tests/effects serves here too."""

import sys
from pathlib import Path

for folder in ("body", "effects"):
    sys.path.insert(0, str(Path(__file__).parents[1] / folder))
