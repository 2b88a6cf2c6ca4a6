"""Tangents of whole runs, in plain Python: what compiles them takes a minute, this does not."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest

from drake_racket.engines.compiled.steps import DP_ERROR
from drake_racket.engines.compiled.tangents.lanes import LANES
from drake_racket.engines.compiled.tangents.replay import _share_of_error
from tests.conftest import ROOT

CODE = """
import sys
sys.modules["numba"] = None
import dataclasses, json
from drake_racket import OUTPUTS, IntegratorSettings, Scenario, simulate
from drake_racket.cases.keys import find_key, number_of, with_values
from drake_racket.results.outputs import read_outputs

# a light, stiff ball stays for 0.2 ms; steps of one length are the same ones for differences
BASE = Scenario(
    support="grip", engine="compiled", approach_time=3e-5, after=3e-4, offset_x=0.02,
    incidence_deg=20.0, overrides={"ball.mass": 0.0116, "ball.stiffness_low": 4.5e5},
    integrator=IntegratorSettings(accuracy=1e-2, error_control=False, maximum_step=4e-5),
)
SURFACE = dataclasses.replace(
    BASE, support="clamped_head", contact="surface", spin_rpm=-1500.0, incidence_deg=40.0
)
found = []
for base, names in ((BASE, ["offset_x"]), (SURFACE, ["ball.damping_low", "after", "spin_rpm",
                                                     "offset_x", "racket.string_bed.mass"])):
    made = simulate(base, derivatives=names, history=False).derivatives
    outputs = [OUTPUTS[name] for name in made.outputs]
    for name, column in zip(names, made.table.T):
        key = find_key(name, base, "test")
        value = number_of(base, key)
        ends = [
            read_outputs(simulate(with_values(base, {key: s * value}, {}), history=False), outputs)
            for s in (1.0 - 1e-4, 1.0 + 1e-4)
        ]
        found.append((name, made.outputs, list(column), *ends, 2e-4 * value))
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def found():
    done = subprocess.run(
        [sys.executable, "-c", CODE], capture_output=True, text=True, check=True, cwd=ROOT
    )
    return json.loads(done.stdout)


def test_derivatives_of_two_runs_against_differences(found):
    """A ball at a held racket's strings, and one with spin that grips, slides and leaves."""
    assert len(found) == 6
    for name, outputs, column, low, high, width in found:
        assert np.isfinite(column).sum() >= 40
        rounding = 1e-11 * (1.0 + np.abs(np.array(low, dtype=float))) / width
        expected = np.subtract(high, low) / width
        for output, ours, theirs, least in zip(outputs, column, expected, rounding, strict=True):
            told = name, output
            assert ours == pytest.approx(theirs, rel=2e-5, abs=abs(least), nan_ok=True), told
    # the second has an end of contact within the run, which the ball's damping moves
    name, outputs, column = found[1][:3]
    assert abs(column[outputs.index("contact_time")]) > 1e-9


def test_a_steps_error_is_a_share_of_the_largest_derivative_so_far():
    rng = np.random.default_rng(2)
    slopes, new = rng.normal(size=(7, 3, LANES)), rng.normal(size=(3, LANES))
    scale, h = np.array([1.0, 2.0, 0.5]), 1e-3
    new[:, 1] = 0.0  # a direction without an effect so far
    found = np.zeros(LANES)
    sizes = np.linalg.norm(scale[:, None] * new, axis=0)
    errors = np.linalg.norm(h * scale[:, None] * np.tensordot(DP_ERROR, slopes, 1), axis=0)
    shares = [e / s for e, s in zip(errors, sizes, strict=True) if s > 0.0]
    assert _share_of_error(h, slopes, new, scale, found) == pytest.approx(max(shares), rel=1e-12)
    assert found == pytest.approx(sizes, rel=1e-12)
    found[:] = 1e3
    assert _share_of_error(h, slopes, new, scale, found) == pytest.approx(max(errors) / 1e3)
    assert found.tolist() == [1e3] * LANES
