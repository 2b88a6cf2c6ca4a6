"""Fits of any parameters to numbers measured on whole impacts."""

from __future__ import annotations

import csv
import dataclasses

import numpy as np
import pytest

from drake_racket import OUTPUTS, InputError, Scenario, simulate
from drake_racket.cases.keys import with_settings
from drake_racket.identify import Search, fit_impacts, read_measured_impacts

BASE = Scenario(support="grip", after=0.006, approach_time=2e-4, engine="compiled")
TRUTH = {"ball.damping_low": 16.0, "racket.head.mass": 0.165}
MEASURED = ("rebound_speed", "contact_time", "rebound_angle")
SD = {"rebound_speed": 0.02, "contact_time": 1e-5, "rebound_angle": 0.003}


def write(path, rows):
    with path.open("w", newline="") as file:
        csv.writer(file).writerows(rows)
    return path


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """Nine impacts of a racket and ball that are not the base's, with noise."""
    truth = with_settings(BASE, [f"{k}={v}" for k, v in TRUTH.items()])
    rng = np.random.default_rng(2)
    header = ["speed [m/s]", "offset_x [mm]", "incidence_deg", "point"]
    header += [f"{n} [{OUTPUTS[n].units}]" for n in MEASURED]
    header += [f"{n}_sd [{OUTPUTS[n].units}]" for n in MEASURED]
    rows = [header]
    for speed in (18.0, 24.0, 30.0):
        for offset, incidence in ((-30.0, 10.0), (0.0, 20.0), (40.0, 0.0)):
            made = dataclasses.replace(
                truth, speed=speed, offset_x=1e-3 * offset, incidence_deg=incidence, point="auto"
            )
            result = simulate(made, history=False)
            values = [OUTPUTS[n].read(result) + rng.normal(0.0, SD[n]) for n in MEASURED]
            if offset == 0.0:
                values[2] = ""  # not measured
            rows.append([speed, offset, incidence, "auto", *values, *SD.values()])
    return write(tmp_path_factory.mktemp("impacts") / "impacts.csv", rows)


@pytest.mark.slow
def test_a_fit_finds_what_the_impacts_were_made_with(table):
    data = read_measured_impacts(table, BASE)
    assert data.conditions == ("speed", "offset_x", "incidence_deg", "point")
    assert data.scenarios[0].offset_x == pytest.approx(-0.03)
    assert np.isnan(data.values).sum() == 3
    fit = fit_impacts(data, BASE, {"ball.damping_low": (5.0, 40.0), "racket.head.mass": None})
    assert len(fit.result.residuals) == 24
    assert 0.5 < fit.result.residual_sigma < 1.5
    for name, value in TRUTH.items():
        estimate = fit.estimates[name]
        assert abs(estimate.value - value) < 3.5 * estimate.standard_error
        low, high = estimate.interval
        assert 0.0 < high - low < 0.3 * value
    assert fit.scenario.overrides["racket.head.mass"] == fit.estimates["racket.head.mass"].value
    away = (fit.modelled - data.values) / data.sigma
    assert away[np.isfinite(away)] == pytest.approx(fit.result.residuals)


@pytest.mark.slow
def test_derivatives_of_the_residuals_against_differences(table):
    from drake_racket.cases.keys import find_key, number_of
    from drake_racket.identify import Parameter
    from drake_racket.identify.impacts.problem import ImpactsProblem

    data = read_measured_impacts(table, BASE)
    keys = [find_key(name, BASE, "test") for name in TRUTH]
    x = np.array([number_of(BASE, key) for key in keys])
    parameters = [
        Parameter(k.name, k.unit, 0.5 * v, 2.0 * v, v) for k, v in zip(keys, x, strict=True)
    ]
    problem = ImpactsProblem(data, keys, parameters, "test")
    found = problem.jacobian(x)
    for j, value in enumerate(x):
        step = 1e-4 * value * np.eye(len(x))[j]
        expected = (problem.residuals(x + step) - problem.residuals(x - step)) / (2e-4 * value)
        assert found[:, j] == pytest.approx(expected, rel=2e-3, abs=1e-3 * np.abs(expected).max())


@pytest.mark.slow
def test_what_the_data_do_not_determine_is_said(table):
    data = read_measured_impacts(table, BASE)
    both = ["ball.damping_low", "ball.sliding_distance_scale"]
    fit = fit_impacts(data, BASE, both, options=Search(starts=1, tolerance=1e-4))
    assert not np.isfinite(fit.estimates["ball.sliding_distance_scale"].interval).any()
    assert any("sliding_distance" in text for text in fit.warnings)


HEAD = "speed [m/s],rebound_speed [m/s]"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("speed [m/s]\n20\n", "a column of an output"),
        ("sped [m/s],rebound_speed [m/s]\n20,8\n", "speed"),
        (f"{HEAD}\n20,x\n", "a finite number"),
        (f"{HEAD}\n-20,8\n", "speed"),
        ("speed [m/s],rebound_speed [s]\n20,8\n", "rebound_speed"),
        (f"{HEAD},contact_time [s]\n20,8,0.004\n", "rebound_speed_sd"),
        (f"{HEAD},rebound_speed_sd [m/s]\n20,8,0\n", "above 0"),
        (f"{HEAD},contact_time_sd [s]\n20,8,0.1\n", "the measured output beside it"),
        ("support,peak_hand_force [N]\nfree,8\n", "outputs that this impact has"),
        ("support,rebound_speed [m/s]\nheld,8\n", "clamped_head"),
    ],
)
def test_bad_tables_are_refused_in_one_line(tmp_path, text, told):
    path = tmp_path / "impacts.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=told) as refused:
        read_measured_impacts(path, Scenario())
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("free", "told"),
    [
        ([], "one key or more"),
        (["support"], "numbers of the impact"),
        (["speed"], "keys that it leaves open"),
        (["offset_x"], "bounds"),
        ({"ball.mass": (0.1, 0.2)}, "lower < start < upper"),
        (["ball.mas"], "ball.mass"),
    ],
)
def test_bad_requests_are_refused_before_a_run(tmp_path, free, told):
    path = tmp_path / "impacts.csv"
    path.write_text(f"{HEAD}\n20,8\n")
    data = read_measured_impacts(path, Scenario())
    with pytest.raises(InputError, match=told):
        fit_impacts(data, Scenario(), free)
