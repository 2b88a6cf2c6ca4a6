"""Fits of the string-bed: tables and what they refuse, recovery, and the parameter file."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drake_racket.engines.clamped.batch import make_bed, make_impacts, run
from drake_racket.identify.core.estimate import Estimate
from drake_racket.identify.core.search import Search
from drake_racket.identify.report import directory
from drake_racket.identify.report.outputs import write_string_bed
from drake_racket.identify.report.parameter_file import Provenance, fitted_racket, write_parameters
from drake_racket.identify.strings import string_bed as string_bed_module
from drake_racket.identify.strings.restitution_table import RestitutionTable, read_restitution
from drake_racket.identify.strings.string_bed import (
    StringBedFit,
    StringBedProblem,
    fit_string_bed,
    fit_tension,
    free_parameters,
)
from drake_racket.identify.strings.table_rows import beyond
from drake_racket.io.errors import InputError
from drake_racket.io.files import write_table
from drake_racket.parameters.ball import load_ball
from drake_racket.parameters.overrides import apply_overrides
from drake_racket.parameters.racket import load_racket, read_racket
from drake_racket.rigs.head_clamped import normal_impacts
from studies.identification_recovery import recovery
from tests.conftest import clamped_problem
from tests.oracles.clamped_impact import simulate

HEADER = "point,approach_speed [m/s],restitution"
ONE = Search(starts=1)


def write(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def oracle() -> RestitutionTable:
    """Restitution of the tour racket at high tension by the independent ODE."""
    rows = [(5, 18.0), (5, 33.0), (2, 24.0), (7, 30.0)]
    values = [simulate(clamped_problem("tour", "high", p, v)).rebound_speed / v for p, v in rows]
    points, speeds = (np.array(column) for column in zip(*rows, strict=True))
    count = np.ones(len(rows), dtype=np.int64)
    return RestitutionTable(
        points=points,
        speeds=speeds,
        restitution=np.array(values),
        sigma=None,
        repeats=count,
        where="oracle",
        sha256="0" * 64,
    )


@pytest.fixture(scope="module")
def fitted(oracle: RestitutionTable) -> StringBedFit:
    return fit_tension(oracle, load_racket("tour", "low"), load_ball(), options=ONE)


def test_options_left_out_are_a_searchs_own(oracle, monkeypatch) -> None:
    asked = []

    def spy(problem, options, *rest):
        asked.append(options)
        return found(problem, ONE, *rest)

    found = string_bed_module.search
    monkeypatch.setattr(string_bed_module, "search", spy)
    fit_string_bed(oracle, load_racket("tour", "low"), load_ball(), free=["T0"])
    assert asked == [Search()]


def test_tension_alone_from_independent_data(fitted: StringBedFit) -> None:
    true = load_racket("tour", "high").string_bed.initial_tension.value
    assert fitted.estimates["T0"].value == pytest.approx(true, rel=1e-4)
    assert fitted.rms < 1e-5
    assert fitted.rms_by("point").keys() == {2.0, 5.0, 7.0}
    assert fitted.rms_by("speed").keys() == {18.0, 24.0, 30.0, 33.0}


def test_derivatives_are_those_of_the_residuals(oracle: RestitutionTable) -> None:
    racket = load_racket("tour", "low")
    free = free_parameters(racket, ["T0", "k3", "p6"])
    problem = StringBedProblem(oracle, racket, load_ball(), free, "test")
    x = np.array([p.start for p in free])
    exact = problem.jacobian(x)
    for i in range(3):
        h = np.zeros(3)
        h[i] = 1e-4 * x[i]
        central = (problem.residuals(x + h) - problem.residuals(x - h)) / (2.0 * h[i])
        np.testing.assert_allclose(exact[:, i], central, rtol=1e-5, atol=1e-7 / x[i])


def test_three_parameters_from_exact_data() -> None:
    racket, ball = load_racket(), load_ball()
    rng = np.random.default_rng(0)
    none = recovery.Noise.none()
    made = recovery.restitution_table(
        racket, ball, rng, points=[2, 4, 5], speeds=[18.0, 25.0, 33.0], repeats=1, noise=none
    )
    start = {"T0": 500.0, "k3": 9e5, "k4": 4e5}
    table = recovery.measured_restitution(made)
    fit = fit_string_bed(table, racket, ball, free=list(start), start=start, options=ONE)
    truth = recovery.string_bed_truth(racket, list(start))
    found = {name: e.value for name, e in fit.estimates.items()}
    assert found == pytest.approx(truth, rel=1e-6)
    assert fit.rms < 1e-9
    assert "no impacts at points" not in " ".join(fit.warnings)  # the table was not read from file


def test_mean_of_repeats_by_hand(tmp_path: Path) -> None:
    path = write(
        tmp_path / "t.csv",
        "# four shots at one setting, two at another",
        HEADER + ",repeat",
        *("5,20.0,0.80,1", "5,20.0,0.82,2", "5,20.0,0.84,3", "5,20.0,0.82,4"),
        *("5,30.0,0.75,1", "5,30.0,0.75,2"),
    )
    mean = read_restitution(path).averaged()
    np.testing.assert_allclose(mean.restitution, [0.82, 0.75])
    assert mean.repeats.tolist() == [4, 2]
    # (20 m/s)^2 (2 * 0.02^2) over 6 - 2 degrees of freedom is the variance of one speed
    s = np.sqrt(400.0 * 2.0 * 0.02**2 / 4.0)
    np.testing.assert_allclose(mean.sigma, [s / 20.0 / 2.0, s / 30.0 / np.sqrt(2.0)])


def test_mean_of_repeats_without_scatter_or_with_their_own_errors(tmp_path: Path) -> None:
    """Repeats that are alike to the last digit say nothing of the scatter."""
    rows = ("5,20.0,0.80,1", "5,20.0,0.80,2", "7,30.0,0.75,1")
    path = write(tmp_path / "t.csv", HEADER + ",repeat", *rows)
    mean = read_restitution(path).averaged()
    assert mean.sigma is None
    assert mean.repeats.tolist() == [2, 1]
    own = [f"{row},{error}" for row, error in zip(rows, ("0.03", "0.04", "0.02"), strict=True)]
    path = write(tmp_path / "t.csv", HEADER + ",repeat,standard_deviation", *own)
    assert read_restitution(path).averaged().sigma == pytest.approx([0.025, 0.02])


def test_error_of_a_ratio_of_speeds() -> None:
    rng = np.random.default_rng(0)
    v, w = 20.0 + 0.1 * rng.standard_normal(200_000), 16.0 + 0.1 * rng.standard_normal(200_000)
    one = np.array([5])
    table = RestitutionTable(
        points=one,
        speeds=np.array([20.0]),
        restitution=np.array([0.8]),
        sigma=None,
        repeats=one,
        where="",
        sha256="",
    )
    sigma = table.with_speed_sigma(0.1).sigma
    assert sigma is not None
    assert sigma[0] == pytest.approx(np.std(w / v) / np.sqrt(5.0), rel=0.01)
    with pytest.raises(InputError, match="speed_sigma"):
        table.with_speed_sigma(0.0)


REFUSED = {
    "unit": (["point,approach_speed [mph],restitution", "5,40,0.8"], r"mph.*approach_speed \[m"),
    "no unit": (["point,approach_speed,restitution", "5,20,0.8"], r"a column approach_speed \[m/s"),
    "per cent": (["point,approach_speed [m/s],restitution [%]", "5,20,80"], "restitution"),
    "column": (["point,approach_speed [m/s]", "5,20"], "a column restitution"),
    "column twice": ([HEADER + ",restitution", "5,20,0.8,0.8"], "restitution twice"),
    "above one": ([HEADER, "5,20,0.8", "5,30,1.2"], "row 3, restitution: got 1.2"),
    "zero": ([HEADER, "5,20,0"], "row 2, restitution"),
    "not finite": ([HEADER, "5,20,nan"], "row 2, restitution.*finite"),
    "text": ([HEADER, "5,fast,0.8"], r"row 2, approach_speed \[m/s\]: got 'fast'.*text"),
    "point": ([HEADER, "10,20,0.8"], "row 2, point.*1 to 9"),
    "between points": ([HEADER, "4.5,20,0.8"], "point"),
    "speed": ([HEADER, "5,200,0.8"], "1 to 100 m/s"),
    "row twice": ([HEADER, "5,20,0.8", "5,20,0.8"], "row 3.*row 2.*repeat"),
    "shot twice": ([HEADER + ",repeat", "5,20,0.8,1", "5,20,0.9,1"], "row 3.*row 2"),
    "cells": ([HEADER, "5,20"], "row 2: got '2 cells: 5,20'"),
    "no rows": ([HEADER], "no rows"),
    "contradiction": (
        [HEADER + ",rebound_speed [m/s]", "5,20,0.8,18"],
        "row 2, restitution: got 0.8.*0.9",
    ),
    "several": ([HEADER + ",racket", "5,20,0.8,a", "6,20,0.8,b"], "racket: got 'a, b'.*select"),
    "sigma": ([HEADER + ",standard_deviation", "5,20,0.8,0"], "standard_deviation.*above 0"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_bad_tables_are_refused(name: str, tmp_path: Path) -> None:
    lines, message = REFUSED[name]
    with pytest.raises(InputError, match=message) as caught:
        read_restitution(write(tmp_path / "t.csv", *lines))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("header", "row", "good", "bad"),
    [
        (HEADER, "5,{},0.8", ("1", "100"), ("0.99", "100.1")),
        (HEADER, "{},20,0.8", ("1", "9"), ("0", "10")),
        (HEADER, "5,20,{}", ("0.001", "1"), ("0", "1.001")),
        (HEADER + ",standard_deviation", "5,20,0.8,{}", ("0.001", "0.5"), ("0", "0.501")),
        (HEADER + ",rebound_speed [m/s]", "5,20,{},16", ("0.8",), ("0.9",)),
    ],
)
def test_numbers_of_a_table_are_taken_up_to_their_borders(tmp_path, header, row, good, bad) -> None:
    for text in good:
        assert len(read_restitution(write(tmp_path / "t.csv", header, row.format(text))).points)
    for text in bad:
        with pytest.raises(InputError, match="row 2"):
            read_restitution(write(tmp_path / "t.csv", header, row.format(text)))


def test_normal_speeds_beyond_the_balls_are_told() -> None:
    """From 1.5 m/s on below 18 and above 33 m/s."""
    ball = load_ball()
    assert beyond(np.array([16.51, 25.0, 34.49]), ball) == []
    (low,) = beyond(np.array([16.49, 25.0, 16.0]), ball)
    assert low.startswith("2 of 3 rows at normal speeds of 16 to 16.5 m/s, outside the ball's 18")
    (high,) = beyond(np.array([25.0, 34.51]), ball)
    assert high.startswith("1 of 2 rows at normal speeds of 34.5 to 34.5 m/s")


def test_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="readable CSV"):
        read_restitution(tmp_path / "none.csv")


CELL = st.one_of(
    st.integers(-1, 11).map(str),
    st.floats(-1.0, 120.0).map(lambda x: f"{x:.3g}"),
    st.sampled_from(["", "nan", "inf", "1e400", "0x10", "1_0", "٣", '"', "#", "a,b", "é"]),
)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(rows=st.lists(st.lists(CELL, min_size=2, max_size=4), max_size=4))
def test_any_table_is_read_or_refused(
    rows: list[list[str]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.csv"
    write(path, HEADER, *(",".join(row) for row in rows))
    try:
        table = read_restitution(path).averaged()
    except InputError:
        return
    assert ((table.restitution > 0.0) & (table.restitution <= 1.0)).all()
    assert np.isin(table.points, range(1, 10)).all()
    assert table.repeats.sum() == len(rows)


def test_what_a_table_lacks_is_said(tmp_path: Path) -> None:
    lines = [HEADER, *(f"{p},20,0.{80 + p}" for p in (1, 2, 3, 4, 5, 6, 8))]
    table = read_restitution(write(tmp_path / "t.csv", *lines))
    assert "no impacts at points 7, 9" in table.warnings
    assert any(text.startswith("one speed only (20 m/s)") for text in table.warnings)
    racket, ball = load_racket(), load_ball()
    with pytest.raises(InputError, match=r"rows: got '7 for 11 free"):
        fit_string_bed(table, racket, ball)
    slow = read_restitution(write(tmp_path / "s.csv", HEADER, "5,8,0.85", "5,20,0.8"))
    fit = fit_string_bed(slow, racket, ball, free=["T0"], options=ONE)
    assert any("1 of 2 rows at normal speeds of 8 to 8 m/s" in text for text in fit.warnings)


def test_one_speed_leaves_stiffness_undetermined(tmp_path: Path) -> None:
    """With errors of 1 % T0 is found from one speed, k1 and p2 are not, and that is said."""
    rng = np.random.default_rng(3)
    e = 0.86 + 0.01 * rng.standard_normal(9)
    lines = [HEADER + ",standard_deviation", *(f"{p},18,{e[p - 1]:.4f},0.01" for p in range(1, 10))]
    table = read_restitution(write(tmp_path / "t.csv", *lines))
    fit = fit_string_bed(table, load_racket(), load_ball(), free=["T0", "k1", "p2"], options=ONE)
    said = [text for text in fit.warnings if "is not determined by these data" in text]
    assert {text.split()[0] for text in said} == {"k1", "p2"}
    assert any("one speed only" in text for text in fit.warnings)


def test_rows_of_one_bed_are_selected(tmp_path: Path) -> None:
    header = "racket,tension,point,speed [m/s],restitution [1],rebound_speed [m/s]"
    rows = "tour,low,5,18.0,0.87,15.66", "tour,high,5,18.0,0.86,15.48"
    path = write(tmp_path / "t.csv", header, *rows)
    with pytest.raises(InputError, match="select tension=high"):
        read_restitution(path)
    table = read_restitution(path, select={"tension": "low"})
    assert (table.points, table.speeds, table.restitution) == ([5], [18.0], [0.87])
    with pytest.raises(InputError, match="got 'middle'; allowed: high, low"):
        read_restitution(path, select={"tension": "middle"})


@pytest.mark.slow
def test_table_of_the_study_is_read(tmp_path: Path) -> None:
    data = normal_impacts(rackets=["tour"], points=[5], speeds=[18.0])
    write_table(data, tmp_path / "normal.csv")
    with pytest.raises(InputError, match="select tension=high"):
        read_restitution(tmp_path / "normal.csv")
    table = read_restitution(tmp_path / "normal.csv", select={"tension": "low"})
    assert table.restitution[0] == float(data["restitution"].sel(tension="low").squeeze())


def test_bounds_are_narrower_for_annealing(oracle: RestitutionTable) -> None:
    annealing = Search(method="annealing", starts=1, evaluations=5)
    for options, span in ((Search(starts=1), 10.0), (annealing, 3.0)):
        fit = fit_string_bed(
            oracle, load_racket(), load_ball(), free=["T0"], start={"T0": 600.0}, options=options
        )
        bounds = fit.result.parameters[0]
        assert (bounds.lower, bounds.upper) == pytest.approx((600.0 / span, 600.0 * span))


BAD_OPTIONS = {
    "unknown": ({"free": ["T0", "k9"]}, "free: got 'k9'"),
    "twice": ({"free": ["T0", "T0"]}, "each once"),
    "none": ({"free": []}, "free"),
    "start": ({"free": ["T0"], "start": {"k1": 1e5}}, "start: got 'k1'"),
    "negative": ({"start": {"T0": -1.0}}, "start: T0: got -1.0"),
    "span": ({"span": 1.0}, "span: got 1.0"),
}


@pytest.mark.parametrize("name", BAD_OPTIONS)
def test_bad_options_are_refused(name: str, oracle: RestitutionTable) -> None:
    options, message = BAD_OPTIONS[name]
    with pytest.raises(InputError, match=message):
        fit_string_bed(oracle, load_racket(), load_ball(), **options)
    with pytest.raises(InputError, match="method: got 'guess'"):
        Search(method="guess")


def test_files_of_a_fit(fitted: StringBedFit, tmp_path: Path) -> None:
    paths = write_string_bed(fitted, tmp_path, "2011-06-30", stringing_tension=311.0)
    assert all(path.is_file() for path in paths)
    racket, old = load_racket(str(tmp_path / "racket.yaml")), load_racket("tour", "low")
    bed = racket.string_bed
    assert bed.initial_tension.value == fitted.estimates["T0"].value
    assert bed.initial_tension.status == "fitted"
    for text in ("oracle", "0" * 64, "2011-06-30", "least squares", "% of restitution", "interval"):
        assert text in bed.initial_tension.source
    assert bed.stringing_tension.value == 311.0
    assert (bed.stiffness, bed.rim_factors) == (
        old.string_bed.stiffness,
        old.string_bed.rim_factors,
    )
    assert racket.friction == old.friction
    rows = (tmp_path / "residuals.csv").read_text().splitlines()
    assert len(rows) == 1 + len(fitted.problem.table.points)
    assert "T0" in (tmp_path / "report.md").read_text()


def test_what_is_modelled_is_the_fitted_bed(oracle: RestitutionTable) -> None:
    """Of a table that no tension meets."""
    off = np.array([0.01, -0.01, 0.02, 0.0])
    table = dataclasses.replace(oracle, restitution=oracle.restitution + off)
    bed = load_racket("tour", "low")
    fitted = fit_string_bed(table, bed, load_ball(), free=["T0"], options=ONE)
    data, tension = fitted.to_dataset(), fitted.estimates["T0"].value
    bed = apply_overrides(bed, {"racket.string_bed.initial_tension": tension})
    impacts = make_impacts(bed, load_ball(), table.points, table.speeds)
    expected = run([make_bed(bed)], impacts).restitution(impacts)[0]
    np.testing.assert_allclose(data["restitution_modelled"], expected, rtol=1e-6)
    np.testing.assert_array_equal(data["restitution_measured"], table.restitution)
    assert fitted.rms == pytest.approx(np.sqrt(np.mean((expected - table.restitution) ** 2)))


def test_a_report_is_in_per_cent_throughout(fitted: StringBedFit, tmp_path: Path, monkeypatch):
    drawn = {}
    keep = lambda figure, path: drawn.update({path.stem: figure})  # noqa: E731
    monkeypatch.setitem(directory._WRITERS, ".png", keep)
    write_string_bed(fitted, tmp_path, "2011-06-30")
    assert set(drawn) == {"restitution", "residuals", "estimates", "convergence"}  # one number
    residuals = 100.0 * fitted.result.residuals
    (axes,) = drawn["residuals"].axes
    points = [line for line in axes.lines if line.get_label().startswith("point")]
    at = {(float(x), float(y)) for line in points for x, y in zip(*line.get_data(), strict=True)}
    assert at == {*zip(fitted.problem.table.speeds, map(float, residuals), strict=True)}
    assert axes.get_ylabel() == "model - measured [%]"
    lowest = min(min(line.get_ydata()) for line in drawn["convergence"].axes[0].lines)
    assert lowest == pytest.approx(100.0 * fitted.rms)
    text = (tmp_path / "report.md").read_text()
    assert f"RMS difference {100.0 * fitted.rms:.3g} % of restitution over 4 measured" in text
    assert f"| 7 | {abs(residuals[3]):.3g} |" in text
    assert f"| 33 | {abs(residuals[1]):.3g} |" in text
    assert "Intervals: 95 %, likelihood profile" in text


def test_undetermined_values_are_marked(tmp_path: Path) -> None:
    racket = load_racket()
    provenance = Provenance("t.csv", "ab" * 32, "2011-06-30", "least squares", "0.4 %")
    found = {
        "k1": Estimate(1.5e5, 1e4, (1.3e5, 1.7e5), "N/m"),
        "k2": Estimate(3e5, np.inf, (-np.inf, np.inf), "N/m"),
        "mu1": Estimate(0.3, 0.1, (0.1, np.inf), "1"),
        "stiffness_in": Estimate(900.0, 1.0, (898.0, 902.0), "N*m/rad"),
    }
    path = tmp_path / "racket.yaml"
    write_parameters(fitted_racket(racket, found, provenance, name="mine"), path)
    back = read_racket(path)
    assert back.name == "mine"
    own = racket.string_bed.stiffness.value
    assert back.string_bed.stiffness.value == (1.5e5, 3e5, own[2], own[3])
    source = back.string_bed.stiffness.source
    assert "k1: 95 % interval 130000 to 170000 N/m" in source
    assert "k2: not determined by these data (no finite 95 % interval)" in source
    assert "k3, k4 not fitted (printed: Glynn" in source
    assert "mu1: not determined by these data (95 % interval 0.1 to inf)" in (
        back.friction.coefficients.source
    )
    assert back.throat_joint.stiffness_in.value == 900.0
    assert back.throat_joint.stiffness_out == racket.throat_joint.stiffness_out


@pytest.mark.slow
def test_all_eleven_parameters_from_exact_data(bed: tuple[str, str]) -> None:
    racket = load_racket(*bed)
    fit = recovery.exact_string_bed(racket, load_ball(), seed=1)
    assert fit.rms < 1e-6
    truth = recovery.string_bed_truth(racket, None)
    found = {name: e.value for name, e in fit.estimates.items()}
    assert found == pytest.approx(truth, rel=1e-4)


@pytest.mark.slow
def test_intervals_of_the_tension_cover_it() -> None:
    """20 repeats: below 16 of 95 % intervals by chance is one in 400."""
    racket, ball = load_racket("tour", "high"), load_ball()
    trial = recovery.string_bed_trial(
        racket, ball, free=["T0"], points=[2, 5], speeds=[18.0, 33.0], repeats=4
    )
    truth = recovery.string_bed_truth(racket, ["T0"])
    data = recovery.repeat(trial, truth, 20)
    assert recovery.coverage(data)[0] >= 16
    scatter = float(data["estimate"].std())
    assert 0.6 < scatter / float(data["standard_error"].mean()) < 1.5
    # and a value that is 4 standard errors off would be found out
    off = data.assign(true_value=data["true_value"] + 4.0 * scatter)
    assert recovery.coverage(off)[0] < 8
