"""Fits of any parameters to numbers measured on whole impacts."""

from __future__ import annotations

import csv
import dataclasses
import pickle
from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
import pytest

from drake_racket import OUTPUTS, InputError, Scenario, load_scenario, simulate
from drake_racket.cases.keys import find_key, number_of, with_settings
from drake_racket.identify import Parameter, Search, fit_impacts, read_measured_impacts
from drake_racket.identify.impacts import problem as problem_module
from drake_racket.identify.impacts.problem import ImpactsProblem
from drake_racket.identify.report import directory
from drake_racket.identify.report.impacts import scenario_text, write_impacts
from drake_racket.identify.report.parameter_file import Provenance
from drake_racket.io.errors import SimulationError

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
    data = read_measured_impacts(table, BASE)
    keys = [find_key(name, BASE, "test") for name in TRUTH]
    x = np.array([number_of(BASE, key) for key in keys])
    parameters = [
        Parameter(k.name, k.unit, 0.5 * v, 2.0 * v, v) for k, v in zip(keys, x, strict=True)
    ]
    problem = ImpactsProblem(data, keys, parameters, "test")
    found = problem.jacobian(x)
    for j, value in enumerate(x):
        step = 1e-3 * value * np.eye(len(x))[j]
        expected = (problem.residuals(x + step) - problem.residuals(x - step)) / (2e-3 * value)
        assert found[:, j] == pytest.approx(expected, rel=2e-3, abs=1e-3 * np.abs(expected).max())


@pytest.mark.slow
def test_what_the_data_do_not_determine_is_said(table):
    data = read_measured_impacts(table, BASE)
    both = ["ball.damping_low", "ball.sliding_distance_scale"]
    fit = fit_impacts(data, BASE, both, options=Search(starts=1, tolerance=1e-4))
    assert not np.isfinite(fit.estimates["ball.sliding_distance_scale"].interval).any()
    assert any("sliding_distance" in text for text in fit.warnings)


# the problem and its fit, with impacts in closed form

HEAD = "speed [m/s],rebound_speed [m/s]"
ROWS = f"""{HEAD},rebound_speed_sd [m/s],contact_time [s],contact_time_sd [s]
20,7.0,0.1,0.0042,1e-5
20,7.2,0.2,,1e-5
25,8.8,0.1,0.0041,1e-5
30,10.6,0.1,,1e-5
"""
MASS, DAMPING = "racket.head.mass", "ball.damping_low"


@pytest.fixture
def runs(monkeypatch):
    """Impacts that rebound with v (10 m + c / 100), in contact for 4 ms + c x 10 us: what ran."""
    done = []

    @contextmanager
    def diagram(case):
        yield case

    def run(case, system, own, outputs, history):
        value = {p.name: p.value for p in own}
        done.append((case.scenario.speed, tuple(value.values()), [o.name for o in outputs]))
        if value[DAMPING] > 39.0:
            raise SimulationError("too stiff")
        v, c = case.scenario.speed, value[DAMPING]
        m = value.get(MASS, 0.17)
        rows = {
            "rebound_speed": (
                v * (10.0 * m * m + 0.01 * c),
                {MASS: 20.0 * m * v, DAMPING: 0.01 * v},
            ),
            "contact_time": (4e-3 + 1e-5 * c, {MASS: 0.0, DAMPING: 1e-5}),
        }
        assert history == any(o.needs_history for o in outputs)
        values = np.array([rows[o.name][0] for o in outputs])
        table = np.array([[rows[o.name][1][p.name] for p in own] for o in outputs])
        for p in own:  # one key is moved, the others stay
            moved = p.at(1.01 * p.value)
            found = {DAMPING: moved.ball.damping_low.value, MASS: moved.racket.head.mass.value}
            for other in own:
                share = 1.01 if other is p else 1.0
                assert found[other.name] == pytest.approx(share * other.value, rel=1e-12)
        return None, SimpleNamespace(values=values, table=table)

    monkeypatch.setattr(problem_module, "using_diagram", diagram)
    monkeypatch.setattr(problem_module.derivatives, "run_with_derivatives", run)
    return done


@pytest.fixture
def rows(tmp_path):
    path = tmp_path / "impacts.csv"
    path.write_text(ROWS)
    return read_measured_impacts(path, BASE)


def test_a_fit_without_options_begins_once_at_the_base(rows, runs):
    fit = fit_impacts(rows, BASE, [DAMPING, MASS])
    assert len(fit.result.convergence) == 1
    assert runs[0][2] == ["rebound_speed", "contact_time"]  # tried first, whole
    at = {key: number_of(BASE, find_key(key, BASE, "test")) for key in (DAMPING, MASS)}
    assert runs[0][1] == tuple(at.values())
    for p in fit.result.parameters:
        assert (p.lower, p.start, p.upper) == pytest.approx(
            (at[p.name] / 5.0, at[p.name], 5.0 * at[p.name]), rel=1e-12
        )
    # the textbook's least squares, of u = 10 m^2 and c
    sd = np.array([0.1, 0.2, 0.1, 0.1, 1e-5, 1e-5])
    v = np.array([20.0, 20.0, 25.0, 30.0])
    design = np.array([[x, 0.01 * x] for x in v] + [[0.0, 1e-5]] * 2) / sd[:, None]
    measured = np.array([7.0, 7.2, 8.8, 10.6, 2e-4, 1e-4]) / sd
    u, c = np.linalg.lstsq(design, measured)[0]
    assert fit.estimates[DAMPING].value == pytest.approx(c, rel=1e-5)
    assert fit.estimates[MASS].value == pytest.approx(np.sqrt(u / 10.0), rel=1e-5)
    assert fit.scenario.overrides[MASS] == fit.estimates[MASS].value
    expected = np.full((4, 2), np.nan)
    expected[:, 0], expected[[0, 2], 1] = v * (u + 0.01 * c), 4e-3 + 1e-5 * c
    np.testing.assert_allclose(fit.modelled, expected, rtol=1e-5)
    assert len(fit.warnings) == 1
    assert "larger than sigma allows (reduced chi squared 12.7)" in fit.warnings[0]
    more = fit_impacts(rows, BASE, [DAMPING], options=Search(starts=3), profiles=True)
    assert len(more.result.convergence) == 3
    half = 1.959964 * more.estimates[DAMPING].standard_error
    low, high = more.estimates[DAMPING].interval
    assert 0.5 * (high - low) == pytest.approx(half, rel=1e-3)


def test_one_place_is_run_once_and_only_for_what_was_measured(rows, runs):
    keys = [find_key(name, BASE, "test") for name in (DAMPING, MASS)]
    parameters = [Parameter(k.name, k.unit, 0.01, 50.0, 0.1) for k in keys]
    problem = ImpactsProblem(rows, keys, parameters, "test")
    x = np.array([20.0, 0.2])
    first = problem.residuals(x)
    assert [run[2] for run in runs] == [
        ["rebound_speed", "contact_time"],
        ["rebound_speed"],
        ["rebound_speed", "contact_time"],
        ["rebound_speed"],
    ]
    slopes = problem.jacobian(x)
    assert slopes.shape == (6, 2)
    assert len(runs) == 4
    first[:], slopes[:] = 0.0, 0.0  # what is handed out is the caller's own
    # in standard deviations, row by row
    expected = [(12.0 - 7.0) / 0.1, 0.0, (12.0 - 7.2) / 0.2, (15.0 - 8.8) / 0.1, 10.0]
    assert problem.residuals(x)[:5] == pytest.approx(expected, abs=1e-9)
    assert problem.jacobian(x)[0] == pytest.approx([2.0, 800.0])
    assert problem.jacobian(x)[1] == pytest.approx([1.0, 0.0])
    other = problem.residuals(np.array([21.0, 0.2]))
    assert len(runs) == 8
    assert other[0] == pytest.approx((20.0 * 0.61 - 7.0) / 0.1)
    assert pickle.loads(pickle.dumps(problem.__getstate__()))["_kept"] is None
    # where no impact comes about, there is no number
    assert np.isnan(problem.residuals(np.array([40.0, 0.2]))).all()
    assert np.isnan(problem.jacobian(np.array([40.0, 0.2]))).all()
    assert problem.residual_unit == "standard deviations"
    assert len(problem.sigma) == 6


def test_without_standard_deviations_residuals_are_in_the_outputs_unit(tmp_path, runs):
    path = tmp_path / "impacts.csv"
    path.write_text(f"{HEAD}\n20,8\n30,\n25,9\n")
    data = read_measured_impacts(path, BASE)
    key = find_key(DAMPING, BASE, "test")
    problem = ImpactsProblem(data, [key], [Parameter(key.name, key.unit, 1.0, 30.0, 10.0)], "test")
    found = problem.residuals(np.array([10.0]))
    assert found == pytest.approx([20.0 * 0.389 - 8.0, 25.0 * 0.389 - 9.0])
    assert [run[0] for run in runs] == [20.0, 25.0]  # an impact without a measurement is not run
    assert (problem.residual_unit, problem.sigma) == ("m/s", None)
    modelled = problem.modelled(np.array([10.0]))[:, 0]
    np.testing.assert_allclose(modelled, [20.0 * 0.389, np.nan, 25.0 * 0.389])


def test_what_is_written_is_the_fit(rows, runs, tmp_path, monkeypatch):
    monkeypatch.setitem(
        directory._WRITERS, ".png", lambda figure, path: drawn.update({path.name: figure})
    )
    drawn = {}
    fit = fit_impacts(rows, BASE, [DAMPING, MASS])
    paths = write_impacts(fit, tmp_path / "out", "2011-06-30")
    assert [path.name for path in paths] == [
        *("scenario.yaml", "result.json", "result.nc", "impacts.csv", "impacts.png"),
        *("residuals.png", "estimates.png", "correlation.png", "convergence.png", "report.md"),
    ]
    assert load_scenario(paths[0]) == fit.scenario
    text = paths[0].read_text()
    assert text.startswith("# fitted to impacts.csv (sha256 ")
    assert f"# {DAMPING}: 95 % interval" in text
    lines = list(csv.DictReader(paths[3].open()))
    assert [line["output"] for line in lines] == [
        *("rebound_speed", "contact_time", "rebound_speed"),
        *("rebound_speed", "contact_time", "rebound_speed"),
    ]
    assert [line["row"] for line in lines] == ["2", "2", "3", "4", "4", "5"]
    assert [float(line["measured"]) for line in lines] == [7.0, 0.0042, 7.2, 8.8, 0.0041, 10.6]
    modelled = fit.modelled[np.isfinite(rows.values)]
    assert [float(line["modelled"]) for line in lines] == pytest.approx(modelled)
    report = paths[-1].read_text()
    assert "over 6 measured values of 4 impacts" in report
    assert "| rebound_speed | m/s | 4 |" in report
    assert set(drawn) == {path.name for path in paths if path.suffix == ".png"}
    one = fit_impacts(rows, BASE, [DAMPING])
    names = [path.name for path in write_impacts(one, tmp_path / "one", "2011-06-30")]
    assert "correlation.png" not in names  # of one number with itself
    same = dataclasses.replace(fit, scenario=Scenario())
    provenance = Provenance("t.csv", "ab", "2011-06-30", "least squares", "1 m/s")
    assert scenario_text(same, provenance).splitlines()[-1] == "{}"


# refusals


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
