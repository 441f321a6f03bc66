"""The command and the folder of real recordings, as other tests have them."""

from __future__ import annotations

from tests.cli.conftest import bsip
from tests.recordings.conftest import real_data

__all__ = ["bsip", "real_data"]
