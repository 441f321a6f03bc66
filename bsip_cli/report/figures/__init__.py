"""The reports' figures. matplotlib and fontconfig are told where their caches are to lie.

Without a home that can be written to, both would print warnings, in every process.
"""

import os

from bsip_cli.caches import cache_home

if home := cache_home():
    os.environ["XDG_CACHE_HOME"] = str(home)
    os.environ.setdefault("MPLCONFIGDIR", str(home / "matplotlib"))
