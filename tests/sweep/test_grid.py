"""The grid runner that the impact rigs share: labels, order, processes, bad input."""

from __future__ import annotations

import json

import numpy as np
import pytest

from drake_racket import InputError, Scenario, simulate
from drake_racket.rigs.cases import REBOUND_SPEED, RESTITUTION, run_grid
from tests.conftest import clamped_problem
from tests.oracles.clamped_impact import simulate as oracle

BASE = Scenario(support="clamped_head", audit=False, approach_time=1e-4, after=0.008)


def test_every_value_stands_at_its_labels():
    dataset = run_grid(
        BASE,
        {"tension": ["high", "low"], "racket": ["recreational"], "point": [8, 1], "speed": [20.0]},
        (RESTITUTION, REBOUND_SPEED),
    )
    assert dataset["restitution"].dims == ("tension", "racket", "point", "speed")
    for tension in ("low", "high"):
        for point in (1, 8):
            expected = oracle(clamped_problem("recreational", tension, point, 20.0)).rebound_speed
            at = dataset.sel(tension=tension, racket="recreational", point=point, speed=20.0)
            assert float(at["rebound_speed"]) == pytest.approx(expected, abs=2e-5)
            assert float(at["restitution"]) == pytest.approx(expected / 20.0, abs=1e-6)
    assert dataset["speed"].attrs["units"] == "m/s"
    assert json.loads(dataset.attrs["scenario"])["support"] == "clamped_head"


def test_a_labelled_axis_stands_for_several_changes():
    axes = {"case": {"slow": {"speed": 18.0, "point": "5"}, "edge": {"speed": 25.0, "point": 4}}}
    dataset = run_grid(BASE, axes, (REBOUND_SPEED,))
    expected = simulate(Scenario(**(vars(BASE) | {"speed": 25.0, "point": "4"})), history=False)
    assert list(dataset["case"].values) == ["slow", "edge"]
    found = float(dataset["rebound_speed"].sel(case="edge"))
    assert found == np.linalg.norm(expected.rebound_velocity)


def test_processes_change_nothing():
    axes = {"tension": ["low", "high"], "point": [2, 5, 9]}
    seen: list[tuple[int, int]] = []
    alone = run_grid(BASE, axes)
    shared = run_grid(BASE, axes, workers=2, progress=lambda done, all_: seen.append((done, all_)))
    assert alone.identical(shared)
    assert seen[-1] == (6, 6)
    assert [done for done, _ in seen] == sorted({done for done, _ in seen})


def test_warnings_are_kept_once():
    dataset = run_grid(BASE, {"speed": [8.0, 25.0], "point": [5, 4]}, (RESTITUTION,))
    (warning,) = json.loads(dataset.attrs["warnings"])
    assert "outside the identified" in warning


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        ({"point": []}, "empty axis"),
        ({"point": [5, 10]}, "got '10'"),
        ({"point": [5, 5]}, "each value once"),
        ({"speed": [20.0, float("nan")]}, "finite number"),
        ({"pointt": [5]}, "unknown key"),
        ({"tension": ["middle"]}, "tension"),
        ({"case": {"a": {"sped": 3.0}}}, "sped"),
    ],
)
def test_a_bad_axis_is_refused_before_any_case_runs(axes, said):
    done: list[int] = []
    with pytest.raises(InputError, match=said) as error:
        run_grid(BASE, axes, progress=lambda n, _: done.append(n))
    assert "\n" not in str(error.value)
    assert not done


@pytest.mark.parametrize("workers", [0, -1, 1.5, True, 1000])
def test_bad_workers_are_refused(workers):
    with pytest.raises(InputError, match="workers"):
        run_grid(BASE, {"point": [5]}, workers=workers)
