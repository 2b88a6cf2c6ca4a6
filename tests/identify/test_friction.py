"""Fits of friction: against impulse ratios in closed form, and where the data say little."""

from __future__ import annotations

import math
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drake_racket.engines.clamped.batch import make_bed, make_impacts, run
from drake_racket.identify.core.problem import Parameter
from drake_racket.identify.core.search import Search
from drake_racket.identify.report import directory
from drake_racket.identify.report.outputs import write_friction
from drake_racket.identify.strings import friction as friction_module
from drake_racket.identify.strings.angle_table import AngleTable, read_angles
from drake_racket.identify.strings.friction import (
    LITTLE,
    FrictionFit,
    FrictionProblem,
    _warnings,
    fit_friction,
)
from drake_racket.io.errors import InputError
from drake_racket.parameters.ball import load_ball
from drake_racket.parameters.racket import load_racket

ONE = Search(starts=1)
POINTS = np.array([5, 2, 7])
TRUE = {"mu1": 0.31, "mu2": 0.38, "mu3": 0.42}
MU = np.array([0.31, 0.38, 0.42])  # at POINTS


def normal_restitution(speeds: np.ndarray) -> np.ndarray:
    """Friction acts along the strings, which only move across: the normal motion is its own."""
    impacts = make_impacts(load_racket(), load_ball(), POINTS, speeds)
    return run([make_bed(load_racket())], impacts).restitution(impacts)[0]


def table(
    incidence: float, angle: np.ndarray, sigma: float | None, speed: float = 31.0
) -> AngleTable:
    ones = np.ones(3)
    return AngleTable(
        points=POINTS,
        speeds=speed * ones,
        incidence=incidence * ones,
        azimuth=90.0 * ones,
        angle=angle,
        sigma=None if sigma is None else sigma * ones,
        repeats=np.ones(3, dtype=np.int64),
        where="closed form",
        sha256="0" * 64,
    )


def sliding_table(incidence: float, sigma: float | None) -> AngleTable:
    """Ball that slides throughout: it loses mu times the normal impulse along the strings."""
    normal = 31.0 * math.cos(math.radians(incidence)) * np.ones(3)
    along = 31.0 * math.sin(math.radians(incidence))
    e = normal_restitution(normal)
    left = along - MU * (1.0 + e) * normal
    assert (left > 1.0).all()
    return table(incidence, np.degrees(np.arctan2(left, e * normal)), sigma)


@pytest.fixture(scope="module")
def sliding() -> FrictionFit:
    return fit_friction(sliding_table(60.0, 0.1), load_racket(), load_ball(), options=ONE)


def test_friction_of_a_sliding_ball_in_closed_form(sliding: FrictionFit) -> None:
    found = {name: e.value for name, e in sliding.estimates.items()}
    # friction mu N v / sqrt(v^2 + s^2), s = 0.02 m/s, lacks s^2/2v^2 of mu: 1e-6 at 15 m/s
    assert found == pytest.approx(TRUE, rel=1e-5)
    assert sliding.sliding.all()
    assert not any("moves it by" in text for text in sliding.warnings)
    for name, e in sliding.estimates.items():
        slope = 100.0 * sliding.sensitivity[name]  # deg per 1
        half = 0.5 * (e.interval[1] - e.interval[0])
        assert half == pytest.approx(1.96 * 0.1 / slope, rel=0.02)


def test_options_left_out_are_a_searchs_own(monkeypatch) -> None:
    asked = []

    def spy(problem, options, *rest):
        asked.append(options)
        return found(problem, ONE, *rest)

    found = friction_module.search
    monkeypatch.setattr(friction_module, "search", spy)
    fit_friction(sliding_table(60.0, 0.1), load_racket(), load_ball())
    assert asked == [Search()]


def test_a_coefficient_at_its_bound_is_bounded_on_one_side() -> None:
    start = {"mu1": 0.36, "mu2": 0.4, "mu3": 0.41}
    options = {"options": ONE, "bounds": (0.35, 1.5), "start": start}
    fitted = fit_friction(sliding_table(60.0, 0.1), load_racket(), load_ball(), **options)
    found = fitted.estimates["mu1"]
    assert (found.value, found.interval[0]) == (0.35, -math.inf)
    assert 0.35 < found.interval[1] < 0.351
    assert fitted.estimates["mu2"].value == pytest.approx(TRUE["mu2"], rel=1e-5)


@pytest.mark.parametrize(
    ("slope", "told"),
    [(0.0101 / LITTLE * 0.1, ""), (0.0099 / LITTLE * 0.1, "moves it by"), (0.0, "its whole range")],
)
def test_a_coefficient_that_angles_hardly_tell_is_named(sliding, slope, told) -> None:
    all_slide = np.ones(3, dtype=bool)
    texts = _warnings(sliding.problem, all_slide, {"mu1": slope})
    assert len(texts) == bool(told)
    if told:
        assert told in texts[0]
        assert texts[0].startswith("mu1: an error of 0.1 deg")
    some = np.array([True, False, False])
    assert "in 2 of 3 impacts the ball stops sliding" in _warnings(sliding.problem, some, {})[0]


def test_intervals_of_unknown_noise_are_students() -> None:
    """Each angle twice, 0.1 deg too large and too small: s^2 = 6 0.1^2 / 3, of three freedoms."""
    once = sliding_table(60.0, None)
    angle = np.concatenate([once.angle + 0.1, once.angle - 0.1])
    twice = replace(once.rows(np.tile(np.arange(3), 2)), angle=angle)
    fitted = fit_friction(twice, load_racket(), load_ball(), options=ONE)
    assert fitted.result.residual_sigma == pytest.approx(0.1 * math.sqrt(2.0), rel=1e-3)
    for name, e in fitted.estimates.items():
        slope = 100.0 * fitted.sensitivity[name]  # deg per 1, of either angle
        half = 0.5 * (e.interval[1] - e.interval[0])
        assert half == pytest.approx(3.1824 * 0.1 / slope, rel=0.02)


def test_derivatives_are_those_of_the_residuals() -> None:
    parameters = tuple(Parameter(n, "1", 0.02, 1.5, v) for n, v in TRUE.items())
    problem = FrictionProblem(sliding_table(60.0, None), load_racket(), load_ball(), parameters, "")
    x = np.array([0.3, 0.35, 0.4])
    h = 1e-5
    central = (problem.residuals(x + h) - problem.residuals(x - h)) / (2.0 * h)
    np.testing.assert_allclose(problem.jacobian(x), np.diag(central), rtol=1e-6, atol=1e-9)
    assert np.isnan(problem.residuals(np.full(3, np.nan))).all()


def test_step_leaves_nothing_of_the_angle() -> None:
    parameters = tuple(Parameter(n, "1", 0.02, 1.5, v) for n, v in TRUE.items())
    found = {}
    for step in (4e-6, 1e-6):
        args = (sliding_table(73.0, None), load_racket(), load_ball(), parameters, "")
        found[step] = FrictionProblem(*args, step=step).residuals(MU)
    assert np.abs(found[4e-6] - found[1e-6]).max() < 1e-7  # degrees


@pytest.fixture(scope="module")
def sticking() -> FrictionFit:
    """17 degrees from the normal: the ball has stopped sliding; angles of 0 with errors of 0.3."""
    measured = table(17.0, np.array([0.2, -0.3, 0.1]), 0.3)
    return fit_friction(measured, load_racket(), load_ball(), options=ONE)


def test_a_ball_that_stops_sliding_bounds_friction_from_below(sticking: FrictionFit) -> None:
    normal = 31.0 * math.cos(math.radians(17.0)) * np.ones(3)
    e = normal_restitution(normal)
    for i, name in enumerate(("mu1", "mu2", "mu3")):
        low, high = sticking.estimates[name].interval
        assert high == math.inf
        # sliding to the end up to tan(17 deg) / (1 + e); the interval ends where 2 sigma is left
        critical = math.tan(math.radians(17.0)) / (1.0 + e[i])
        assert 0.96 * critical < low < critical
        assert any(f"{name} is not determined" in text for text in sticking.warnings)
        assert any(text.startswith(f"{name}: an error of 0.1 deg") for text in sticking.warnings)
    assert not sticking.sliding.any()
    assert any("stops sliding before it leaves" in text for text in sticking.warnings)


def test_files_of_a_fit(sticking: FrictionFit, tmp_path: Path) -> None:
    paths = write_friction(sticking, tmp_path, "2011-06-30")
    assert all(path.is_file() for path in paths)
    racket = load_racket(str(tmp_path / "racket.yaml"))
    mu = racket.friction.coefficients
    assert mu.value == tuple(e.value for e in sticking.estimates.values())
    assert mu.status == "fitted"
    assert "mu3: not determined by these data (95 % interval" in mu.source
    assert racket.string_bed == load_racket().string_bed


def test_a_report_is_in_degrees_throughout(sticking: FrictionFit, tmp_path: Path, monkeypatch):
    drawn = {}
    keep = lambda figure, path: drawn.update({path.stem: figure})  # noqa: E731
    monkeypatch.setitem(directory._WRITERS, ".png", keep)
    write_friction(sticking, tmp_path, "2011-06-30")
    assert {"rebound_angles", "residuals", "correlation"} <= set(drawn)
    (axes,) = drawn["residuals"].axes
    points = [line for line in axes.lines if line.get_label().startswith("point")]
    shown = [float(line.get_ydata()[0]) for line in points]
    assert shown == pytest.approx(list(sticking.result.residuals), rel=1e-12)
    assert {float(line.get_xdata()[0]) for line in points} == {17.0}
    assert axes.get_ylabel() == "model - measured [deg]"
    text = (tmp_path / "report.md").read_text()
    assert "In 0 of 3 impacts the ball slides until it leaves." in text
    for name, slope in sticking.sensitivity.items():
        assert f"| {name} | {slope:.3g} |" in text
    assert f"RMS difference {sticking.rms:.3g} deg over 3 measured values" in text


HEADER = "point,approach_speed [m/s],incidence [deg],azimuth [deg],rebound_angle [deg]"
REFUSED = {
    "unit": ([HEADER.replace("incidence [deg]", "incidence [gon]"), "5,31,70,90,60"], "incidence"),
    "grazing": ([HEADER, "5,31,90,90,60"], "row 2, incidence"),
    "normal": ([HEADER, "5,31,0,90,60"], "row 2, incidence"),
    "angle": ([HEADER, "5,31,60,90,120"], "row 2, rebound_angle"),
    "fast": ([HEADER, "5,100.5,60,90,50"], "row 2, approach_speed"),
    "scatter": ([HEADER + ",standard_deviation [deg]", "5,31,60,90,50,45.2"], "standard_dev"),
    "row twice": ([HEADER, "5,31,60,90,50", "5,31,60,90,51"], "row 3"),
    "column": (["point,approach_speed [m/s],incidence [deg]", "5,31,60"], "rebound_angle"),
    "stroke": (["point,stroke,angle_reading,rebound_angle [deg]", "5,lob,from_plane,70"], "lob"),
}


@pytest.mark.parametrize(
    ("row", "good", "bad"),
    [
        ("5,31,{},90,60,1", ("0.1", "89"), ("0.099", "89.1")),
        ("5,31,60,{},60,1", ("-360", "360"), ("-361", "361")),
        ("5,31,60,90,{},1", ("-90", "90"), ("-90.1", "90.1")),
        ("5,31,60,90,60,{}", ("0.001", "45"), ("0", "45.1")),
    ],
)
def test_angles_are_taken_up_to_their_borders(tmp_path, row, good, bad) -> None:
    path = tmp_path / "t.csv"
    for text in (*good, *bad):
        path.write_text(f"{HEADER},standard_deviation [deg]\n{row.format(text)}\n")
        with pytest.raises(InputError, match="row 2") if text in bad else nullcontext():
            assert len(read_angles(path).points) == 1
    path.write_text(f"{HEADER.replace(',azimuth [deg]', '')}\n5,31,60,50\n")
    assert read_angles(path).azimuth.tolist() == [90.0]


@pytest.mark.parametrize("name", REFUSED)
def test_bad_tables_are_refused(name: str, tmp_path: Path) -> None:
    lines, message = REFUSED[name]
    path = tmp_path / "t.csv"
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match=message):
        read_angles(path)


def test_table_of_the_study_is_read(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(
        "stroke,angle_reading,point,rebound_angle [rad]\n"
        "topspin_drive,from_plane,5,1.2\nslice,from_plane,5,1.25\n"
    )
    found = read_angles(path)
    np.testing.assert_allclose(found.speeds, [31.0, 25.0])
    np.testing.assert_allclose(found.incidence, [73.0, 74.0])
    np.testing.assert_allclose(found.azimuth, [90.0, -90.0])
    np.testing.assert_allclose(found.angle, np.degrees([1.2, 1.25]))
    np.testing.assert_allclose(np.linalg.norm(found.velocities, axis=1), found.speeds)
    np.testing.assert_allclose(found.velocities[1, 1], -25.0 * math.sin(math.radians(74.0)))


def test_repeats_are_averaged_by_direction(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    rows = ["5,31.2,73,90,70.1,1", "5,30.8,73,90,70.3,2", "5,31,74,90,71,1"]
    path.write_text("\n".join([HEADER + ",repeat", *rows]) + "\n")
    mean = read_angles(path).averaged()
    np.testing.assert_allclose(mean.angle, [70.2, 71.0])
    np.testing.assert_allclose(mean.speeds, [31.0, 31.0])
    s = math.sqrt(2.0 * 0.1**2)
    np.testing.assert_allclose(mean.sigma, [s / math.sqrt(2.0), s])


def test_bad_options_are_refused() -> None:
    measured, racket, ball = sliding_table(60.0, None), load_racket(), load_ball()
    for options, message in (
        ({"reading": "spin"}, "friction_reading: got 'spin'"),
        ({"bounds": (0.0, 1.0)}, "bounds"),
        ({"start": {"mu4": 0.3}}, "start: got 'mu4'"),
        ({"start": {"mu1": 2.0}}, "mu1: start"),
    ):
        with pytest.raises(InputError, match=message):
            fit_friction(measured, racket, ball, **options)
