"""Commands where less is possible than elsewhere: a pipe that closes, no place or room to write."""

from __future__ import annotations

import ctypes
import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import xarray

from drake_racket.laws.compilation import HAS_NUMBA
from tests.conftest import ROOT

pytestmark = pytest.mark.slow
COMMAND = f"{sys.executable} -m drake_racket.cli"
SWEEP = "base: {after: 0.002, audit: false}\naxes: {speed: {values: [18, 20], unit: m/s}}\n"
LAW = """
import numpy as np
from drake_racket.laws.contact import COMPILED_MOTION
x, v = np.zeros((3, 4)), np.zeros(6)
x[:, :3], v[5] = np.eye(3), 2.0
print(COMPILED_MOTION(x, x, 0.0 * v, v)[1])
"""


def run(command: list[str], folder: Path, limit=None, **more: str):
    environment = os.environ | {"PYTHONPATH": str(ROOT), "NUMBA_DISABLE_JIT": "0"} | more
    return subprocess.run(
        command, env=environment, cwd=folder, preexec_fn=limit,
        capture_output=True, text=True, timeout=60.0, check=False,
    )  # fmt: skip


def test_a_pipe_that_closes_after_one_line(tmp_path):
    (tmp_path / "w.yaml").write_text(SWEEP + "outputs: [restitution]\n")
    for arguments in ("show tour", "sweep w.yaml --out s --workers 2"):
        line = f"{COMMAND} {arguments} | head -1; exit ${{PIPESTATUS[0]}}"
        done = run(["bash", "-c", line], tmp_path)
        assert done.stdout.count("\n") == 1
        assert "Traceback" not in done.stderr
        assert done.returncode in (0, 1), done.stderr  # 1: it could not say all
    with xarray.open_dataset(tmp_path / "s" / "results.nc") as dataset:
        assert dataset["status"].values.tolist() == [0, 0]


def no_right_to_write_everywhere() -> None:
    """Takes from root what lets it write where permissions say no."""
    for right in (1, 2):  # CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH; of the bounding set
        ctypes.CDLL(None).prctl(24, right, 0, 0, 0)


@pytest.mark.skipif(not HAS_NUMBA or sys.platform != "linux", reason="needs numba and prctl")
def test_an_install_that_nobody_can_write_to(tmp_path):
    """No place for numba's cache, matplotlib's or a file; the work is done all the same."""
    package, home, out = (tmp_path / name for name in ("package", "home", "out"))
    shutil.copytree(
        ROOT, package, ignore=shutil.ignore_patterns(".git", "__pycache__", "tests", "docs")
    )
    home.mkdir()
    out.mkdir()
    for path in (package, *package.rglob("*"), home):
        path.chmod(0o555)
    there = {"PYTHONPATH": str(package), "HOME": str(home), "MPLCONFIGDIR": str(out)}
    there["XDG_CACHE_HOME"] = str(home / "cache")
    command = [*COMMAND.split(), "impact", "--after", "0.002", "--out"]
    refused = run([*command, "here"], home, no_right_to_write_everywhere, **there)
    assert refused.returncode == 2
    assert refused.stderr.startswith("drake-racket: --out: got 'here'; allowed: a directory that")
    assert refused.stderr.count("\n") == 1
    law = run([sys.executable, "-c", LAW], home, no_right_to_write_everywhere, **there)
    assert (law.stdout, law.stderr) == ("(0.0, 0.0, 2.0)\n", "")
    assert not list(home.iterdir())
    assert not list(package.rglob("*.nb?"))


@pytest.mark.skipif(not HAS_NUMBA, reason="no compiler, no cache")
def test_a_full_disk_costs_numbas_cache_and_not_the_run(tmp_path):
    def full() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (5000, resource.RLIM_INFINITY))

    for limit in (full, None):  # and what was left of it is in nobody's way
        done = run([sys.executable, "-c", LAW], tmp_path, limit, NUMBA_CACHE_DIR=str(tmp_path))
        assert (done.stdout, done.stderr) == ("(0.0, 0.0, 2.0)\n", "")
    assert list(tmp_path.rglob("*.nbc"))
