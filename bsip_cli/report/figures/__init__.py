"""The reports' figures, with the places of matplotlib's and fontconfig's caches.

Without a home that can be written to, both would print warnings, in every process.
"""

import os

from bsip_cli.caches import cache_home

if home := cache_home():
    os.environ["XDG_CACHE_HOME"] = str(home)
    os.environ.setdefault("MPLCONFIGDIR", str(home / "matplotlib"))
