"""What bsip costs and how exact it is; run from the checkout as ``python -m benchmarks.NAME``."""

import os

# One thread, as the command line has it; numpy reads these when it is imported.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
