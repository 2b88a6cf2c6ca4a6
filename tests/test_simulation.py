"""`simulate` builds a Diagram once per topology, and gives the same bits with a used one."""

from __future__ import annotations

import dataclasses
from collections import OrderedDict

import pytest

import drake_racket.simulation
from drake_racket import Scenario, make_impact_diagram, simulate
from tests.limbs.arms import HUMANOID, striking


@pytest.fixture
def built(monkeypatch):
    """Topologies that a Diagram is built for, from here on."""
    monkeypatch.setattr(drake_racket.simulation, "_kept", OrderedDict())
    found = []

    def build(case):
        found.append(case.topology)
        return make_impact_diagram(case)

    monkeypatch.setattr(drake_racket.simulation, "make_impact_diagram", build)
    return found


SHORT = Scenario(after=1e-3, audit=False)


def numbers(scenario):
    return simulate(scenario, history=False).to_json()


def test_one_diagram_serves_a_topology(built):
    fast = dataclasses.replace(SHORT, speed=30.0, point="2", overrides={"ball.mass": 0.06})
    first = numbers(SHORT), numbers(fast), numbers(SHORT)
    assert len(built) == 1
    assert first[0] == first[2] != first[1]
    fresh = simulate(fast, make_impact_diagram(fast), history=False).to_json()
    assert fresh == first[1]


def test_another_topology_has_its_own(built):
    numbers(SHORT)
    numbers(dataclasses.replace(SHORT, support="clamped_handle"))
    numbers(dataclasses.replace(SHORT, overrides={"racket.head.length": 0.331}))
    numbers(SHORT)
    assert len(built) == 3


def test_few_are_kept(built):
    for step in range(6):
        numbers(dataclasses.replace(SHORT, gravity=(0.0, 0.0, -float(step))))
    assert len(drake_racket.simulation._kept) == 4
    numbers(SHORT)
    assert len(built) == 7  # the first was dropped


def test_a_limb_of_a_file_is_built_anew(built, tmp_path):
    """What the file includes may have changed."""
    (tmp_path / "arm.urdf").write_text(HUMANOID)
    case = striking(tmp_path / "arm.urdf", "left_hand", after=5e-4, audit=False)
    assert numbers(case) == numbers(case)
    assert len(built) == 2


def test_a_run_within_a_run_has_a_diagram_of_its_own(built):
    """Asked for by a progress callback, say, or by another thread."""
    inner = []

    def report(progress):
        if not inner:
            inner.append(numbers(SHORT))

    outer = simulate(SHORT, history=False, progress=report).to_json()
    assert inner == [outer]
    assert len(built) == 2


@pytest.mark.slow
def test_a_loop_does_not_grow():
    import resource

    def size() -> int:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    for speed in range(10, 14):
        numbers(dataclasses.replace(SHORT, speed=float(speed)))
    before = size()
    for i in range(100):
        numbers(dataclasses.replace(SHORT, speed=14.0 + 0.1 * i))
    assert size() - before < 10_000  # kB; 58 MB with a Diagram each on Drake 1.51
