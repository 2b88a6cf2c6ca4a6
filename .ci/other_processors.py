"""Runs tests again as another processor would: other BLAS kernels, no vector units, plain code.

A fit or a kernel that passes here and fails there compares sums of the same numbers in another
order. `python .ci/other_processors.py` runs the default tests of fits once for each processor that
this machine can stand for, and those of kernels and laws where it is not BLAS that differs.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from numpy._core import _multiarray_umath as numpy_core

FITS = (
    "tests/identify",
    "studies/ball_calibration",
    "studies/identifiability",
    "studies/spring_assignment",
    "studies/synthetic_laboratory",
)
"""Use BLAS: sums of many numbers."""
KERNELS = ("tests/engines/test_clamped_kernel.py", "tests/engines/compiled", "tests/laws")
"""Use what NumPy and numba make of single laws."""
COMPILED = (
    "tests/identify/test_impacts.py",
    "tests/identify/test_strings.py",
    "tests/engines/test_clamped_kernel.py",
    "tests/engines/compiled/test_trajectories.py",
    "tests/laws",
)
"""Run machine code, which is compiled anew for a plain processor: some of each kind."""


def processors(cache: Path) -> dict[str, dict[str, str]]:
    """Name -> environment variables; only what this machine can run."""
    cores = ["Haswell", "Prescott"]
    info = Path("/proc/cpuinfo")
    if info.exists() and "avx512f" in info.read_text(encoding="utf-8").split():
        cores.append("SkylakeX")
    own = own_core()
    found = {f"BLAS for {c}": {"OPENBLAS_CORETYPE": c} for c in cores if c.lower() != own.lower()}
    # what NumPy chooses at run time here; its baseline cannot be disabled
    features = [f for f in numpy_core.__cpu_dispatch__ if numpy_core.__cpu_features__[f]]
    if features:
        found["NumPy without vector units"] = {"NPY_DISABLE_CPU_FEATURES": " ".join(features)}
    found["numba for any processor"] = {
        "NUMBA_CPU_NAME": "generic",
        "NUMBA_CPU_FEATURES": "",
        "NUMBA_CACHE_DIR": str(cache),
    }
    return found


def own_core() -> str:
    """The processor for which OpenBLAS takes this one: the tests have run as that already."""
    command = [sys.executable, "-c", "import numpy"]
    variables = os.environ | {"OPENBLAS_VERBOSE": "2"}
    said = subprocess.run(command, env=variables, capture_output=True, text=True, check=True)
    lines = (said.stdout + said.stderr).splitlines()
    return next((s.removeprefix("Core: ") for s in lines if s.startswith("Core: ")), "").strip()


def main() -> int:
    """Status 1 if any fails."""
    failed = []
    own = os.environ | {"OPENBLAS_NUM_THREADS": "1"}  # as many processes as processors
    with tempfile.TemporaryDirectory() as cache:
        for name, variables in processors(Path(cache)).items():
            print(f"== {name}: {variables}", flush=True)
            tests = FITS if name.startswith("BLAS") else (*FITS, *KERNELS)
            if name.startswith("numba"):
                tests = COMPILED
            command = [sys.executable, "-m", "pytest", "-n", "auto", "-q", *tests]
            if subprocess.run(command, env=own | variables, check=False).returncode:
                failed.append(name)
    if failed:
        print(f"failed: {', '.join(failed)}")
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
