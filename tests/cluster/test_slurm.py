"""The workflow on a real SLURM of one node: workflow/test_slurm.sh, where it can run.

Without its recordings: that the artifacts are those of ``make`` is tested without SLURM.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CANNOT = 77
LONGEST_S = 600.0  # a minute and a half where nothing hangs


@pytest.mark.long
def test_node_that_dies_and_job_over_its_memory(tmp_path):
    bsip = tmp_path / "bsip"
    bsip.write_text(f'#!/bin/sh\nexec {sys.executable} -m bsip_cli "$@"\n')
    bsip.chmod(0o755)
    snakemake = ROOT / ".venv-cluster" / "bin" / "snakemake"
    if not snakemake.exists():
        pytest.skip("no Snakemake: `make .venv-cluster/ready` installs it")
    script = ROOT / "workflow" / "test_slurm.sh"
    command = [script, bsip, snakemake, "short"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_S)
    if done.returncode == CANNOT:
        pytest.skip(done.stderr.splitlines()[-1])
    assert done.returncode == 0, done.stdout + done.stderr
    assert "passed: a job over its memory and a node that died" in done.stdout
