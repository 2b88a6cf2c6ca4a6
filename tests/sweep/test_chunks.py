"""Cases travel in chunks, and are integrated in threads: no outcome depends on either."""

from __future__ import annotations

import os
from dataclasses import replace

import pytest

from drake_racket.io.fingerprint import computation
from drake_racket.laws.compilation import HAS_NUMBA
from drake_racket.parameters.scenario import Scenario
from drake_racket.pool import run_in_processes
from drake_racket.results.outputs import find_outputs
from drake_racket.sweep.cases import make_plan
from drake_racket.sweep.chunks import MOST, Chunks
from drake_racket.sweep.runner import _tasks
from drake_racket.sweep.spec import make_sweep
from drake_racket.sweep.worker import CaseOutcome, CaseSettings, CaseTask, each_case

BASE = Scenario(after=0.002, approach_time=0.0)
SETTINGS = CaseSettings(find_outputs(["kb"], "outputs"), {}, {})


def task(case: int, *, data: bool = False) -> CaseTask:
    return CaseTask(case, BASE, "", SETTINGS, data)


def outcomes(count: int, seconds: float) -> list[CaseOutcome]:
    return [CaseOutcome(i, [0.0], seconds=seconds) for i in range(count)]


def test_chunks_grow_to_the_time_asked_for():
    chunks = Chunks((task(i) for i in range(10_000)), 0.5)
    sizes = []
    for chunk in chunks:
        sizes.append(len(chunk))
        chunks.learn(outcomes(len(chunk), 1.0 / 128))
    assert sizes[:5] == [1, 4, 16, 64, 64]
    assert sum(sizes) == 10_000
    chunks = Chunks((task(i) for i in range(10_000)), 0.5)
    for chunk in chunks:
        chunks.learn(outcomes(len(chunk), 0.0))
        assert len(chunk) <= MOST


def test_slow_cases_and_histories_travel_alone():
    chunks = Chunks((task(i, data=i == 5) for i in range(12)), 0.5)
    chunks.learn(outcomes(1, 0.12))
    assert [t.case for t in next(chunks)] == [0, 1, 2, 3]
    assert [t.case for t in next(chunks)] == [4, 5]  # ends with the one that has a history
    chunks.learn(outcomes(2, 3.0))
    assert [t.case for t in next(chunks)] == [6]


@pytest.mark.skipif(not HAS_NUMBA, reason="without numba sweeps run in Drake")
def test_outcomes_do_not_depend_on_threads():
    axes = {
        "point": [5, 2],
        "speed": {"values": [20.0, 25.0, 30.0], "unit": "m/s"},
        "after": {"values": [0.002, 1e-4], "unit": "s"},  # the second ends in contact
        "ball.mass": {"values": [0.9, 1.1], "unit": "1", "relative": True},
    }
    # results read masses from a case's own Context, while others begin
    sweep = make_sweep(BASE, axes, ["rebound_speed", "kb", "energy_ball"])
    plan = make_plan(sweep)
    settings = CaseSettings(sweep.outputs, computation(), plan.files)
    tasks = list(_tasks(sweep, plan, plan.order(), settings))
    broken = replace(tasks[3], scenario=replace(tasks[3].scenario, speed=-1.0))
    tasks = [*tasks[:3], broken, *tasks[4:]]
    found = [[(o.case, o.values, o.failure, o.engine, o.warnings) for o in each_case(tasks, n)]
             for n in (0, 1, 3)]  # fmt: skip
    assert repr(found[1]) == repr(found[0])
    assert repr(found[2]) == repr(found[0])
    assert [case for case, *_ in found[0]] == [t.case for t in tasks]
    assert [bool(failure) for _, _, failure, _, _ in found[0]].count(True) == 1
    assert "speed" in found[0][3][2]


def die_at_seven(numbers: list[int]) -> list[int]:
    if 7 in numbers:
        os._exit(1)
    return numbers


@pytest.mark.slow
def test_a_group_in_which_a_process_dies_is_taken_apart():
    tasks = [[0, 1], [6, 7, 8], [9]]
    found = run_in_processes(
        die_at_seven,
        tasks,
        1,
        died=lambda numbers, reason: [-n for n in numbers],
        split=lambda numbers: [[n] for n in numbers],
    )
    assert sorted(n for batch in found for _, result in batch for n in result) == [
        -7, 0, 1, 6, 8, 9,
    ]  # fmt: skip
