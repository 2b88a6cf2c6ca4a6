"""The runner that the impact rigs share: labels, order, processes, bad input, failures."""

from __future__ import annotations

import json

import numpy as np
import pytest

from drake_racket import ImpactResult, InputError, Output, Scenario, SimulationError, simulate
from drake_racket.io.progress import Progress
from drake_racket.results.outputs import REBOUND_SPEED, RESTITUTION, USUAL
from drake_racket.sweep import make_sweep, run_grid
from tests.conftest import clamped_problem
from tests.oracles.clamped_impact import simulate as oracle

BASE = Scenario(support="clamped_head", audit=False, approach_time=1e-4, after=0.008)


def run(axes, outputs=USUAL, **options):
    return run_grid(make_sweep(BASE, axes, outputs), title="a rig", **options)


def test_every_value_stands_at_its_labels():
    dataset = run(
        {
            "tension": ["high", "low"],
            "racket": ["recreational"],
            "point": [8, 1],
            "speed": {"values": [20.0], "unit": "m/s"},
        },
        (RESTITUTION, REBOUND_SPEED),
    )
    assert list(dataset.data_vars) == ["restitution", "rebound_speed"]
    assert dataset["restitution"].dims == ("tension", "racket", "point", "speed")
    for tension in ("low", "high"):
        for point in (1, 8):
            expected = oracle(clamped_problem("recreational", tension, point, 20.0)).rebound_speed
            at = dataset.sel(tension=tension, racket="recreational", point=point, speed=20.0)
            assert float(at["rebound_speed"]) == pytest.approx(expected, abs=2e-5)
            assert float(at["restitution"]) == pytest.approx(expected / 20.0, abs=1e-6)
    assert dataset["speed"].attrs["units"] == "m/s"
    assert json.loads(dataset.attrs["scenario"])["support"] == "clamped_head"
    assert dataset.attrs["title"] == "a rig"


def test_a_labelled_axis_stands_for_several_changes():
    axis = {
        "keys": {"speed": {"unit": "m/s"}, "point": {}},
        "rows": [[18.0, "5"], [25.0, 4]],
        "labels": ["slow", "edge"],
    }
    dataset = run({"shot": axis}, (REBOUND_SPEED,))
    scenario = Scenario(**(vars(BASE) | {"speed": 25.0, "point": "4", "engine": "compiled"}))
    expected = simulate(scenario, history=False)
    assert list(dataset["shot"].values) == ["slow", "edge"]
    found = float(dataset["rebound_speed"].sel(shot="edge"))
    assert found == np.linalg.norm(expected.rebound_velocity)


def twice(result: ImpactResult) -> float:
    """An output of a rig's own."""
    return 2.0 * float(np.linalg.norm(result.rebound_velocity))


def fails(result: ImpactResult) -> float:
    """An output that stands for a run that cannot be finished."""
    raise SimulationError("stopped at t = 0.001 s")


TWICE = Output("twice", "m/s", "twice the rebound speed", twice)
FAILS = Output("fails", "1", "what no run gives", fails)


def test_processes_change_nothing():
    axes = {"tension": ["low", "high"], "point": [2, 9]}
    outputs = (*USUAL, TWICE)
    seen: list[Progress] = []
    alone = run(axes, outputs)
    shared = run(axes, outputs, workers=2, progress=seen.append)
    assert alone.identical(shared)
    assert (seen[-1].done, seen[-1].total) == (4, 4)
    assert [now.done for now in seen] == sorted({now.done for now in seen})
    assert np.array_equal(alone["twice"], 2.0 * alone["rebound_speed"])


def test_warnings_are_counted():
    axes = {"speed": {"values": [8.0, 25.0], "unit": "m/s"}, "point": [5, 4]}
    said = json.loads(run(axes, (RESTITUTION,)).attrs["warnings"])
    ((warning, count),) = said.items()
    assert "outside the identified" in warning
    assert count == 2


@pytest.mark.parametrize("workers", [1, 2])
def test_a_run_that_fails_ends_the_rest_with_its_own_exception(workers):
    done: list[float] = []
    with pytest.raises(SimulationError, match=r"^stopped at t = 0\.001 s$"):
        run({"point": [5, 2]}, (FAILS,), workers=workers, progress=lambda p: done.append(p.done))
    assert done == [0]


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        ({"point": []}, "empty axis"),
        ({"point": [5, 10]}, "got '10'"),
        ({"point": [5, 5]}, "each value once"),
        ({"speed": {"values": [20.0, float("nan")], "unit": "m/s"}}, "finite number"),
        ({"pointt": [5]}, "got 'pointt'"),
        ({"tension": ["middle", "low"]}, "tension"),
        ({"a": {"keys": {"sped": {}}, "rows": [[3.0]]}}, "sped"),
        # good one by one, and not together: a rig has no cases that do not count
        (
            {
                "aim": {
                    "keys": {"offset_x": {"unit": "m"}, "offset_y": {"unit": "m"}},
                    "rows": [[0.0, 0.0], [0.16, 0.12]],
                }
            },
            "rim",
        ),
    ],
)
def test_a_bad_axis_is_refused_before_any_case_runs(axes, said):
    done: list[Progress] = []
    with pytest.raises(InputError, match=said) as error:
        run(axes, progress=done.append)
    assert "\n" not in str(error.value)
    assert not done


@pytest.mark.parametrize("workers", [0, -1, 1.5, True, 1000])
def test_bad_workers_are_refused(workers):
    with pytest.raises(InputError, match="workers"):
        run({"point": [5]}, workers=workers)
