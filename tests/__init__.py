"""Tests in folders by what they test; helpers are imported by their full name."""

import os

# One thread, as the command line has it; numpy reads these when it is imported. Two workers of two
# threads each on two cores take five times as long.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
