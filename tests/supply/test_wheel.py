"""The wheel, installed where nothing can be written, runs from another folder."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PIP = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
STUDY = ["--participants=1", "--sequence-s=6", "--task=static", "--task=sequence"]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    options = ["--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", str(folder)]
    subprocess.run([*PIP, "wheel", *options, str(ROOT)], check=True)
    (file,) = folder.glob("*.whl")
    return file


@dataclass
class Install:
    """The wheel in a folder of its own, for a user without a home."""

    folder: Path

    @property
    def temporary(self) -> Path:
        return self.folder / "tmp"

    def bsip(self, *arguments: str, code: int = 0) -> subprocess.CompletedProcess:
        return self._run(str(self.folder / "site" / "bin" / "bsip"), *arguments, code=code)

    def place(self) -> Path:
        code = "import bsip_cli; print(bsip_cli.__file__)"
        return Path(self._run(sys.executable, "-c", code).stdout.strip())

    def _run(self, *command: str, code: int = 0) -> subprocess.CompletedProcess:
        places = {
            "PYTHONPATH": str(self.folder / "site"),
            "PYTHONDONTWRITEBYTECODE": "1",
            "HOME": str(self.folder / "file" / "home"),
            "TMPDIR": str(self.temporary),
        }
        unset = {"XDG_CACHE_HOME", "XDG_CONFIG_HOME", "MPLCONFIGDIR", "NUMBA_CACHE_DIR"}
        environment = {name: value for name, value in os.environ.items() if name not in unset}
        done = subprocess.run(
            command,
            cwd=self.folder,
            env=environment | places,
            capture_output=True,
            text=True,
            timeout=600,
        )
        assert done.returncode == code, done.stderr
        return done

    def results(self) -> dict[str, bytes]:
        """Every file of the results under a final name."""
        paths = [path for path in (self.folder / "out").rglob("*") if path.is_file()]
        final = (path for path in paths if not path.name.startswith("."))
        return {str(path.relative_to(self.folder)): path.read_bytes() for path in final}


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory) -> Install:
    """What root may write to as well is barred by files where folders would have to be."""
    install = Install(tmp_path_factory.mktemp("installed"))
    site = install.folder / "site"
    options = ["--no-deps", "--no-index", "--no-compile", "--target", str(site)]
    subprocess.run([*PIP, "install", *options, str(wheel)], check=True)
    (site / "bsip_cli" / "motion" / "__pycache__").write_text("")
    (install.folder / "file").write_text("")
    install.temporary.mkdir()
    install.bsip("simulate", "study", *STUDY)
    return install


def files_below(folder: Path) -> set[str]:
    """What belongs to the package."""
    found = (path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    return {path.as_posix() for path in found if "__pycache__" not in path.parts}


def test_holds_the_package_and_its_configuration(wheel):
    names = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    shipped = {f"bsip_cli/configs/{name}" for name in files_below(ROOT / "configs")}
    assert len(shipped) > 10
    assert names == shipped | {f"bsip_cli/{name}" for name in files_below(ROOT / "bsip_cli")}


@pytest.mark.long
def test_runs_without_the_checkout(installed):
    assert installed.place().is_relative_to(installed.folder)
    said = installed.bsip("run", "study", "--out", "out").stderr.lower()
    assert "results in out" in said
    assert {"out/sub-01/report.html", "out/group/report.html"} <= set(installed.results())
    assert not [library for library in ("matplotlib", "fontconfig", "numba") if library in said]


@pytest.mark.long
def test_published_tables_come_along(installed):
    assert "Hansen 2017" in installed.bsip("published", "audit", "hansen2017").stdout


@pytest.mark.long
def test_a_broken_cache_changes_nothing(installed):
    installed.bsip("run", "study", "--out", "out")  # nothing to do, if the test before has run
    before, kept = installed.results(), sorted(installed.temporary.rglob("*.nbc"))
    assert len(kept) >= 20
    for k, file in enumerate(kept):
        file.write_bytes(file.read_bytes()[:1000] if k % 2 else b"garbage")
    installed.bsip("ik", "study", "--out", "out", "--force")
    assert installed.results() == before
    (outermost,) = (file for file in kept if "solve_frames" in file.name)
    assert outermost.stat().st_size > 1000
