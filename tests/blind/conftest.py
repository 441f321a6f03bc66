"""The scenes that stand in tests/effects serve here too."""

import sys
from pathlib import Path

for _folder in ("body", "effects"):
    sys.path.insert(0, str(Path(__file__).parents[1] / _folder))
