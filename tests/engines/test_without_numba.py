"""The clamped engine's source as plain Python: without numba, and with its compiler off."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from drake_racket.laws.compilation import HAS_NUMBA
from tests.conftest import ROOT

HIDE = """
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("numba", "llvmlite"):
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Absent())
"""
IMPACTS = """
import json
import numpy as np
from drake_racket.engines.clamped.batch import make_bed, make_impacts, run
from drake_racket.laws.compilation import HAS_NUMBA
from drake_racket.parameters.ball import load_ball
from drake_racket.parameters.racket import load_racket
racket, ball = load_racket("recreational", "low"), load_ball()
velocities = np.array([[4.0, 9.0, -22.0], [0.0, 0.0, -33.0]])
impacts = make_impacts(
    racket, ball, [4, 2], velocities, free=2, friction_reading="displacement"
)
outcome = run([make_bed(racket, free=["T0", "p5"])], impacts, step=1e-4)
assert outcome.ended.all()
print(json.dumps([HAS_NUMBA, outcome.values.tolist(), outcome.jacobian.tolist()]))
"""


def result(code: str, **environment: str):
    variables = os.environ | environment | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-W", "error::RuntimeWarning", "-c", code]
    done = subprocess.run(
        command, env=variables, cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    has_numba, values, jacobian = json.loads(done.stdout)
    return has_numba, np.array(values), np.array(jacobian)


@pytest.fixture(scope="module")
def usual():
    return result(IMPACTS)


def check(found, usual) -> None:
    _, values, jacobian = found
    np.testing.assert_allclose(values, usual[1], rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(jacobian, usual[2], rtol=1e-9, atol=1e-13)


def test_it_gives_the_same_without_numba(usual):
    found = result(HIDE + IMPACTS)
    assert not found[0]
    check(found, usual)


@pytest.mark.skipif(not HAS_NUMBA, reason="there is no compiler to turn off")
def test_it_gives_the_same_with_the_compiler_off(usual):
    found = result(IMPACTS, NUMBA_DISABLE_JIT="1")
    assert found[0]
    check(found, usual)
