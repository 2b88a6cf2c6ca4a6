"""kb and cb from forces on a plate: exact derivatives, recovery, coverage, and what is refused."""

from __future__ import annotations

import math
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chi2, linregress

from drake_racket.identify.ball.by_speed import (
    SPEED_SIGMA,
    _check_restitution,
    _correlated,
    _covariance,
    fit_speed,
)
from drake_racket.identify.ball.by_speed import _warnings as _speed_warnings
from drake_racket.identify.ball.fit import (
    BallImpact,
    _warnings,
    fit_ball,
    group_by_speed,
    read_ball_impacts,
)
from drake_racket.identify.ball.impacts import find_contact, resting_offset
from drake_racket.identify.ball.plate_problem import PlateProblem, _first_guess
from drake_racket.identify.ball.plate_sensitivity import plate_force
from drake_racket.identify.ball.speed_line import speed_line
from drake_racket.identify.report.ball_figures import ball_fit_figure
from drake_racket.io.errors import InputError
from drake_racket.io.signals import Signal
from drake_racket.rigs.force_plate.force import closed_form
from drake_racket.rigs.force_plate.plate import make_force_plate
from tests.conftest import write_signal
from tests.oracles.damped_oscillator import Oscillator

MASS, RATE = 0.059, 65e3
FIELDS = {
    "stiffness_low": 45e3,
    "stiffness_growth": 0.52,
    "damping_low": 14.0,
    "damping_growth": 0.97,
}
"""The shipped ball's, between 18 and 33 m/s."""


def law(speed: float) -> tuple[float, float]:
    share = (speed - 18.0) / 15.0
    return 45e3 * (1.0 + 0.52 * share), 14.0 * (1.0 + 0.97 * share)


def impact(
    speed, *, measured=None, noise=0.0, seed=0, touch=0.0, scale=1.0, end=0.006
) -> BallImpact:
    """By the closed form; noise as a share of the peak."""
    kb, cb = law(speed)
    form = closed_form(mass=MASS, stiffness=kb, damping=cb, speed=speed)
    time = np.arange(-65, round(end * RATE)) / RATE
    rng = np.random.default_rng(seed)
    force = form.force(time - touch) + noise * form.peak_force * rng.standard_normal(len(time))
    return BallImpact(Signal(time, scale * force, "force", "N"), measured or speed)


def campaign(seed: int, repeats: int = 2, noise: float = 0.01) -> list[BallImpact]:
    """Noise of 1 % of the peak, speeds measured to 0.1 m/s, touch at no sample."""
    rng = np.random.default_rng(seed)
    return [
        impact(
            v,
            measured=v + 0.1 * rng.standard_normal(),
            noise=noise,
            seed=int(rng.integers(2**31)),
            touch=rng.uniform(0.0, 1.0 / RATE),
        )
        for v in (18.0, 21.0, 24.0, 27.0, 30.0, 33.0)
        for _ in range(repeats)
    ]


# the model


@pytest.mark.parametrize("damping", [0.0, 14.0, 103.0533842, 200.0], ids=str)
def test_force_equals_the_matrix_exponential(damping) -> None:
    """103.05 is critical to nine digits: where the trigonometric form divides by zero."""
    oscillator = Oscillator(MASS, 45e3, damping, 18.0)
    time = np.linspace(0.0, 3e-3, 9)
    force, by = plate_force(time, mass=MASS, stiffness=45e3, damping=damping, speed=18.0)
    np.testing.assert_allclose(force, [oscillator.force(t) for t in time], rtol=1e-9, atol=1e-9)
    rates = [-oscillator.force_rate(t) for t in time]
    np.testing.assert_allclose(by[:, 3], rates, rtol=1e-9, atol=1e-6)


@settings(max_examples=25, deadline=None)
@given(
    stiffness=st.floats(5e3, 3e5),
    ratio=st.floats(0.01, 2.0),
    speed=st.floats(1.0, 60.0),
    mass=st.floats(0.02, 0.2),
)
def test_derivatives_are_those_of_the_force(stiffness, ratio, speed, mass) -> None:
    x = np.array([stiffness, 2.0 * ratio * math.sqrt(stiffness * mass), speed, 0.0])
    w = math.sqrt(stiffness / mass)
    time = np.linspace(0.0, 3.0 / w, 15)

    def force(y):
        return plate_force(time - y[3], mass=mass, stiffness=y[0], damping=y[1], speed=y[2])[0]

    _, by = plate_force(time, mass=mass, stiffness=x[0], damping=x[1], speed=speed)
    steps = 1e-3 * np.array([x[0], x[1], x[2], 1.0 / w])
    for column, step in enumerate(np.diag(steps)):
        wide, narrow = force(x + 2 * step) - force(x - 2 * step), force(x + step) - force(x - step)
        found = (8.0 * narrow - wide) / (12.0 * step[column])
        assert np.abs(by[:, column] - found).max() < 1e-8 * np.abs(found).max()


@pytest.mark.parametrize("ratio", [0.99, 1.01])
def test_derivatives_have_no_step_where_the_series_ends(ratio) -> None:
    """At q t^2 = 0.05, or -0.05."""
    stiffness, damping = 45e3, 2.0 * ratio * math.sqrt(45e3 * MASS)
    q = stiffness / MASS * (1.0 - ratio * ratio)
    times = math.sqrt(0.05 / abs(q)) * np.array([1.0 - 1e-11, 1.0 + 1e-11])
    _, by = plate_force(times, mass=MASS, stiffness=stiffness, damping=damping, speed=18.0)
    np.testing.assert_allclose(by[0, :2], by[1, :2], rtol=1e-9)


def test_jacobian_of_the_problem_is_that_of_its_residuals() -> None:
    impacts = [impact(18.0, measured=18.1), impact(18.2, touch=5e-6)]
    contacts = [find_contact(i, MASS) for i in impacts]
    for held in (0.1, 0.0):
        problem = PlateProblem(impacts, contacts, [MASS, 0.06], speed_sigma=held, noise=5.0)
        x = np.array([p.start for p in problem.parameters])
        jacobian = problem.jacobian(x)
        for i, p in enumerate(problem.parameters):
            step = np.zeros(len(x))
            step[i] = 1e-5 * (p.upper - p.lower)
            found = (problem.residuals(x + step) - problem.residuals(x - step)) / (2.0 * step[i])
            assert np.abs(jacobian[:, i] - found).max() < 1e-6 * np.abs(found).max()


# recovery


def test_drake_rig_gives_back_its_ball() -> None:
    plate = make_force_plate()
    records = [BallImpact(plate.run(v).sampled(), v) for v in (18.0, 25.5, 33.0)]
    fit = fit_ball(records, MASS)
    for group in fit.groups:
        kb, cb = law(round(group.speed, 3))
        assert (group.kb, group.cb) == pytest.approx((kb, cb), rel=1e-6)
        assert group.rms < 1e-6 * group.peak
    for name, value in FIELDS.items():
        assert fit.fields()[name].value == pytest.approx(value, rel=1e-6)
    assert fit.fields()["speed_low"].value == pytest.approx(18.0, rel=1e-7)
    assert fit.warnings == ()


def test_one_start_finds_what_eight_find() -> None:
    noisy = [impact(18.0, noise=0.01, seed=s) for s in range(2)]
    once, often = fit_speed(noisy, MASS), fit_speed(noisy, MASS, starts=8)
    assert (once.kb, once.cb) == pytest.approx((often.kb, often.cb), rel=1e-7)


def test_touch_between_samples_and_a_speed_misread_cost_nothing_without_noise() -> None:
    touch = 0.37 / RATE
    fit = fit_speed([impact(24.0, measured=24.1, touch=touch)], MASS)
    assert (fit.kb, fit.cb) == pytest.approx(law(24.0), rel=1e-6)
    assert fit.speed == pytest.approx(24.0, rel=1e-6)
    assert fit.touches[0] == pytest.approx(touch, abs=1e-10)


def test_mass_of_each_impact() -> None:
    light = BallImpact(impact(21.0).force, 21.0, mass=MASS)
    fit = fit_speed([light], 0.5)
    assert fit.kb == pytest.approx(law(21.0)[0], rel=1e-6)


def test_95_percent_intervals_cover_at_95_percent() -> None:
    """40 repeats of two impacts; and errors over standard errors are of size one."""
    covered, scaled = np.zeros(2), []
    for seed in range(40):
        fit = fit_speed(campaign(seed)[:2], MASS)
        truth = np.array(law(18.0))
        low, high = fit.result.confidence_intervals[:2].T
        covered += (low <= truth) & (truth <= high)
        scaled.append((fit.result.estimates[:2] - truth) / fit.result.standard_errors[:2])
    assert (covered >= 35).all()  # fewer: 1 % of the time, were they right
    assert np.sqrt(np.mean(np.square(scaled), axis=0)) == pytest.approx(1.0, abs=0.25)


def test_speeds_held_as_measured_leave_their_error_in_the_damping() -> None:
    """Why they are estimated: 0.1 m/s is many standard errors of a fit that does not know it."""
    record = [impact(18.0, measured=18.1, noise=0.01)]
    held, free = fit_speed(record, MASS, speed_sigma=0.0), fit_speed(record, MASS)
    off, error = held.cb - law(18.0)[1], held.result.standard_errors[1]
    assert abs(off) > 3.0 * error
    assert abs(free.cb - law(18.0)[1]) < 2.0 * free.result.standard_errors[1]
    assert held.speed == 18.1
    assert held.covariance[2, 2] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("weights", ["scatter", "fit"])
def test_fields_of_the_ball_file_are_covered(weights) -> None:
    covered = dict.fromkeys(FIELDS, 0)
    for seed in range(40):
        fields = fit_ball(
            campaign(seed, 1), MASS, weights=weights, speed_low=18.0, speed_high=33.0
        ).fields()
        for name, value in FIELDS.items():
            low, high = fields[name].interval
            covered[name] += low <= value <= high
    assert min(covered.values()) >= 34  # fewer: 0.4 % of the time, were they right


# lines


def test_line_by_scatter_is_ordinary_least_squares() -> None:
    rng = np.random.default_rng(1)
    speeds = np.array([18.0, 21.0, 24.0, 27.0, 33.0])
    values = 3.0 + 0.2 * speeds + 0.1 * rng.standard_normal(5)
    line = speed_line("kb", "N/m", speeds, values, np.zeros((5, 2, 2)) + np.eye(2) * 0.01)
    known = linregress(speeds, values)
    assert line.slope == pytest.approx(known.slope)
    assert line.gradient().standard_error == pytest.approx(known.stderr)
    assert line.at(0.0).value == pytest.approx(known.intercept)
    assert line.at(0.0).standard_error == pytest.approx(known.intercept_stderr)
    # t of 3 degrees of freedom
    half = 0.5 * (line.gradient().interval[1] - line.gradient().interval[0])
    assert half == pytest.approx(3.182446 * known.stderr, rel=1e-6)


def test_line_by_fit_is_weighted_least_squares() -> None:
    """A speed's error counts, less what it shares with the value's."""
    speeds, values = np.array([18.0, 24.0, 33.0]), np.array([7.0, 8.0, 10.0])
    slope = linregress(speeds, values).slope
    covariances = np.array(
        [[[s * s, 0.5 * s * 0.1], [0.5 * s * 0.1, 0.01]] for s in (0.1, 0.2, 0.4)]
    )
    line = speed_line("cb", "N*s/m", speeds, values, covariances, weights="fit")
    along = np.array([1.0, -slope])
    sigma = np.sqrt([along @ c @ along for c in covariances])
    (b, a), covariance = np.polyfit(speeds, values, 1, w=1.0 / sigma, cov="unscaled")
    assert (line.slope, line.at(0.0).value) == pytest.approx((b, a))
    assert line.gradient().standard_error == pytest.approx(math.sqrt(covariance[0, 0]))
    squares = np.sum(((values - a - b * speeds) / sigma) ** 2)
    assert line.misfit == pytest.approx(chi2.sf(squares, 1))
    assert line.at(0.0).standard_error == pytest.approx(math.sqrt(covariance[1, 1]))


def test_lines_take_the_errors_of_the_speeds_own_fits() -> None:
    records = [impact(v, noise=0.01, seed=round(v)) for v in (18.0, 25.0, 33.0)]
    fit = fit_ball(records, MASS, weights="fit")
    speeds = [group.speed for group in fit.groups]
    for i, name in enumerate(("stiffness", "damping")):
        values = [(group.kb, group.cb)[i] for group in fit.groups]
        along = np.array([1.0, -linregress(speeds, values).slope])
        own = [along @ g.covariance[np.ix_([i, 2], [i, 2])] @ along for g in fit.groups]
        line = getattr(fit, name)
        assert line.variances[0] == pytest.approx(1.0 / np.sum(1.0 / np.array(own)), rel=1e-9)


def test_growth_and_its_error() -> None:
    """Against draws of level and slope."""
    speeds = np.array([18.0, 24.0, 33.0])
    values = 45e3 * (1.0 + 0.52 * (speeds - 18.0) / 15.0)
    covariances = np.array([np.diag([300.0**2, 0.0])] * 3)
    growth = speed_line("kb", "N/m", speeds, values, covariances, weights="fit").growth(18.0, 33.0)
    assert growth.value == pytest.approx(0.52)
    rng = np.random.default_rng(0)
    drawn = values[:, None] + 300.0 * rng.standard_normal((3, 20000))
    slope, intercept = np.polyfit(speeds, drawn, 1)
    grown = (intercept + 33.0 * slope) / (intercept + 18.0 * slope) - 1.0
    assert growth.standard_error == pytest.approx(float(np.std(grown)), rel=0.02)


def test_repeats_of_a_speed_are_one_group() -> None:
    impacts = [impact(v) for v in (21.1, 18.1, 17.9, 33.0, 20.8, 18.0)]
    speeds = [[i.speed for i in group] for group in group_by_speed(impacts)]
    assert speeds == [[17.9, 18.0, 18.1], [20.8, 21.1], [33.0]]


# what the data do not tell


def test_one_speed_gives_no_growth_and_says_so() -> None:
    fit = fit_ball([impact(18.0), impact(18.05)], MASS)
    assert fit.stiffness is None
    assert sorted(fit.fields()) == ["damping_low", "speed_high", "speed_low", "stiffness_low"]
    assert fit.fields()["stiffness_low"].value == pytest.approx(45e3, rel=0.01)
    assert any("one speed only" in text and "growth" in text for text in fit.warnings)
    figure = ball_fit_figure(fit)
    assert len(figure.axes) == 4


def test_two_speeds_give_a_line_and_a_warning() -> None:
    fit = fit_ball([impact(18.0), impact(33.0)], MASS, speed_low=15.0)
    assert fit.stiffness is not None
    assert fit.stiffness.weights == "fit"
    assert any("linear in speed is not tested" in text for text in fit.warnings)
    assert any("goes beyond the measured" in text for text in fit.warnings)
    with pytest.raises(InputError, match="weights"):
        fit_ball([impact(18.0), impact(33.0)], MASS, weights="scatter")


def test_pulses_cut_off_are_fitted_with_a_warning() -> None:
    whole = impact(18.0, noise=0.002).force
    end = BallImpact(Signal(whole.time[:200], whole.value[:200], "force", "N"), 18.0)
    begun = BallImpact(Signal(whole.time[75:], whole.value[75:], "force", "N"), 18.0)
    for record, words in ((end, "ends before release"), (begun, "begins after touch")):
        fit = fit_speed([record], MASS)
        off = np.abs(fit.result.estimates[:2] - law(18.0)) / fit.result.standard_errors[:2]
        assert (off < 3.0).all()
        assert any(words in text for text in fit.warnings)
    rising = Signal(whole.time[:140], whole.value[:140], "force", "N")
    with pytest.raises(InputError, match="past the peak"):
        fit_speed([BallImpact(rising, 18.0)], MASS)


def test_what_the_law_does_not_explain_is_said() -> None:
    good = impact(18.0, noise=0.002)
    time, force = good.force.time, good.force.value
    ringing = 40.0 * np.sin(2.0 * np.pi * 2500.0 * time) * (time > 0.0)
    for value, words in (
        (force + 20.0, "take the offset away"),
        (force + ringing, "neighbouring residuals are alike"),
        (force + ringing * (time > 4e-3), "from the law outside"),
        (force * 1.05, "the force implies"),
    ):
        fit = fit_speed([BallImpact(Signal(time, value, "force", "N"), 18.0)], MASS)
        assert any(words in text for text in fit.warnings), (words, fit.warnings)
    assert fit_speed([good], MASS).warnings == ()


def test_kb_that_is_not_linear_in_speed_is_said() -> None:
    records = [impact(v, noise=0.001) for v in (18.0, 23.0, 28.0, 33.0)]
    bent = impact(23.0, noise=0.001, scale=1.0)
    kb, cb = 1.1 * law(23.0)[0], law(23.0)[1]
    form = closed_form(mass=MASS, stiffness=kb, damping=cb, speed=23.0)
    noise = bent.force.value - impact(23.0).force.value
    force = form.force(bent.force.time) + noise
    records[1] = BallImpact(Signal(bent.force.time, force, "force", "N"), 23.0)
    assert any("kb is not linear" in text for text in fit_ball(records, MASS).warnings)


@pytest.mark.parametrize("speed", [9.0, 40.0])
def test_impossible_restitution_is_refused(speed) -> None:
    """A speed misread: the impulse would be of a ball faster after than before, or stuck."""
    with pytest.raises(InputError, match="restitution") as caught:
        fit_ball([impact(18.0, measured=speed)], MASS)
    assert len(str(caught.value).splitlines()) == 1


def test_bad_numbers_are_refused() -> None:
    good = impact(18.0)
    for call, words in (
        (lambda: fit_ball([], MASS), "records"),
        (lambda: fit_ball([good], 59.0), "mass"),
        (lambda: fit_ball([good], np.nan), "mass"),
        (lambda: fit_ball([good], MASS, speed_sigma=-1.0), "speed_sigma"),
        (lambda: fit_ball([good], MASS, group_width=0.0), "group_width"),
        (lambda: fit_ball([good], MASS, weights="best"), "scatter, fit"),
        (lambda: fit_ball([good, impact(33.0)], MASS, speed_low=40.0), "low < high"),
        (lambda: BallImpact(good.force, 0.0), "speed"),
        (lambda: BallImpact(good.force, 18.0, mass=-1.0), "mass"),
        (lambda: fit_speed([], MASS), "impacts"),
    ):
        with pytest.raises(InputError, match=words):
            call()


# tables


@pytest.fixture(scope="module")
def records(tmp_path_factory):
    """A directory with two records."""
    place = tmp_path_factory.mktemp("impacts")
    for v in (18.0, 33.0):
        write_signal(impact(v).force, place / f"{v:g}.csv")
    (place / "ms.csv").write_text("time [ms],force [N]\n" + "1,1\n" * 30)
    (place / "back.csv").write_text("time [s],force [N]\n" + "1,1\n" * 30)
    return place


def test_table_is_read(records) -> None:
    text = "note,file, speed [m/s] ,mass [kg]\na,18.csv,18,0.058\n\nb,33.csv,33.0,0.0585\n"
    (records / "good.csv").write_text(text)
    first, second = read_ball_impacts(records / "good.csv")
    assert (first.speed, first.mass, second.mass) == (18.0, 0.058, 0.0585)
    assert first.force.value.max() == pytest.approx(impact(18.0).force.value.max(), rel=1e-12)


BAD = {
    "unit": ("file,speed [mph]\n18.csv,40\n", "a column speed"),
    "no unit": ("file,speed\n18.csv,18\n", "a column speed"),
    "mass in oz": ("file,speed [m/s],mass [oz]\n18.csv,18,2\n", "a column mass"),
    "mass": ("file,speed [m/s],mass [kg]\n18.csv,18,59\n", "up to 1 kg"),
    "no file": ("speed [m/s]\n18\n", "a column file"),
    "twice": ("file,file,speed [m/s]\n18.csv,18.csv,18\n", "each column once"),
    "no rows": ("file,speed [m/s]\n", "at least one row"),
    "empty": ("", "at least one row"),
    "cells": ("file,speed [m/s]\n18.csv\n", "1 cells: 18.csv'; allowed: 2 cells"),
    "number": ("file,speed [m/s]\n18.csv,fast\n", "row 2, speed"),
    "nan": ("file,speed [m/s]\n18.csv,nan\n", "a finite number"),
    "speed": ("file,speed [m/s]\n18.csv,-18\n", "0.1 to 100"),
    "no name": ("file,speed [m/s]\n ,18\n", "path of a record"),
    "missing": ("file,speed [m/s]\nnone.csv,18\n", "readable CSV"),
    "same": ("file,speed [m/s]\n18.csv,18\n./18.csv,18\n", "each record once"),
    "ms": ("file,speed [m/s]\nms.csv,18\n", r"time \[s\]"),
    "time": ("file,speed [m/s]\nback.csv,18\n", "times that increase"),
    "quotes": ('file,speed [m/s]\n"18.csv,18\n', "CSV"),
}


@pytest.mark.parametrize("case", list(BAD))
def test_bad_tables_are_refused(records, case) -> None:
    text, words = BAD[case]
    path = records / "bad_table.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        read_ball_impacts(path)
    assert len(str(caught.value).splitlines()) == 1


@settings(max_examples=25, deadline=None)
@given(text=st.text(max_size=80) | st.from_regex(r"file,speed \[m/s\]\n[\w.,;\n-]{0,30}"))
def test_any_text_is_read_or_refused(tmp_path_factory, text) -> None:
    path = tmp_path_factory.mktemp("any") / "table.csv"
    path.write_text(text, encoding="utf-8", errors="replace")
    with pytest.raises(InputError):
        read_ball_impacts(path)


# what is told, and from where on


def lines_of(**changes):
    """Groups of 18, 25 and 33 m/s, and a line that is good but for the changes."""
    speeds = changes.get("speeds", (18.0, 25.0, 33.0))
    ends = changes.get("ends", (4e4, 5e4))
    line = SimpleNamespace(
        name="kb",
        misfit=changes.get("misfit", 0.5),
        scatter=changes.get("scatter", 1.0),
        level=changes.get("level", -5e4),
        at=lambda v: SimpleNamespace(value=ends[0] if v < 25.0 else ends[1]),
    )
    groups = [SimpleNamespace(speed=speed) for speed in speeds]
    return _warnings(groups, (None, line), changes.get("low", 18.0), changes.get("high", 33.0))


@pytest.mark.parametrize(
    ("within", "beyond", "told"),
    [
        ({"low": 17.501}, {"low": 17.499}, "goes beyond the measured 18 to 33 m/s"),
        ({"high": 33.499}, {"high": 33.501}, "goes beyond"),
        ({"misfit": 0.01}, {"misfit": 0.00999}, "not linear in speed"),
        ({"misfit": 0.0, "scatter": 0.499}, {"misfit": 0.0, "scatter": 0.501}, "not linear"),
        ({"ends": (1e-9, 5e4)}, {"ends": (0.0, 5e4)}, "not positive"),
        ({"ends": (5e4, 1e-9)}, {"ends": (5e4, -1.0)}, "not positive"),
        ({}, {"speeds": (18.0, 33.0)}, "two speeds"),
        ({}, {"speeds": (18.0,), "low": 10.0}, "one speed only (18 m/s)"),
    ],
)
def test_what_a_line_leaves_open_is_told_from_its_border_on(within, beyond, told) -> None:
    assert lines_of(**within) == []
    (text,) = lines_of(**beyond)
    assert told in text


def test_covariance_of_kb_cb_and_the_mean_speed() -> None:
    """Four impacts' speeds follow on kb and cb; one number that is open opens what rests on it."""
    a = np.random.default_rng(1).normal(size=(10, 10))
    whole = a @ a.T
    found = _covariance(SimpleNamespace(covariance=whole), 4)
    np.testing.assert_allclose(found[:2, :2], whole[:2, :2])
    np.testing.assert_allclose(found[2, :2], whole[2:6, :2].mean(axis=0))
    np.testing.assert_allclose(found[2, 2], whole[2:6, 2:6].mean())
    held = _covariance(SimpleNamespace(covariance=whole), 0)
    np.testing.assert_allclose(held[:2, :2], whole[:2, :2])
    assert not held[2].any()
    whole[1, 1] = np.inf
    found = _covariance(SimpleNamespace(covariance=whole), 4)
    assert list(np.isinf(np.diag(found))) == [False, True, False]
    np.testing.assert_allclose(found[0, 0], whole[0, 0])
    whole[1, 1], whole[3, 3] = 1.0, np.inf
    assert list(np.isinf(np.diag(_covariance(SimpleNamespace(covariance=whole), 4)))) == [
        *(False, False, True)
    ]


@pytest.mark.parametrize(
    ("restitution", "open_end", "refused"),
    [
        (1.0699, "", 0),
        (1.0705, "", 1),
        (1e-9, "", 0),
        (0.0, "", 1),
        (0.0, "begun", 0),
        (-0.1, "cut_off", 0),
    ],
)
def test_a_restitution_that_the_speeds_error_allows_is_let_pass(
    restitution, open_end, refused
) -> None:
    """At 10 m/s +- 0.1 m/s: up to 1.01 and three times 2.07 per cent."""
    contact = SimpleNamespace(
        restitution=restitution, begun=open_end == "begun", cut_off=open_end == "cut_off"
    )
    impact = SimpleNamespace(speed=10.0, force=SimpleNamespace(where="it"))
    sigma = 0.1 * 0.06 / (3.0 * 0.01 * 2.07) if restitution > 1.0 else 0.1
    with pytest.raises(InputError, match="restitution from") if refused else nullcontext():
        _check_restitution(impact, contact, sigma)


@pytest.mark.parametrize("restitution", [0.2, 0.6, 0.98])
def test_a_first_guess_is_the_law_of_the_pulses_length_and_restitution(restitution) -> None:
    ratio = -math.log(restitution) / math.hypot(math.pi, math.log(restitution))
    guess = _first_guess(contact_of(7e-3, restitution), 0.057)
    form = closed_form(mass=0.057, stiffness=guess[0], damping=guess[1], speed=20.0)
    # the force is tension from where it is zero to the end of the half period
    angle = math.sqrt(guess[0] / 0.057) * math.sqrt(1.0 - ratio**2) * 7e-3
    assert angle == pytest.approx(2.0 * math.acos(ratio), rel=1e-12)
    assert guess[1] == pytest.approx(2.0 * ratio * math.sqrt(guess[0] * 0.057), rel=1e-12)
    assert form.contact_time == pytest.approx(7e-3, rel=1e-9)
    for wild, tame in ((0.0, 0.2), (1.5, 0.98)):
        tamed = _first_guess(contact_of(7e-3, tame), 0.057)
        assert _first_guess(contact_of(7e-3, wild), 0.057) == tamed
    for end in ("begun", "cut_off"):
        cut = _first_guess(contact_of(7e-3, restitution, **{end: True}), 0.057)
        assert cut == pytest.approx(_first_guess(contact_of(10.5e-3, 0.8), 0.057), rel=1e-12)


def contact_of(length, restitution, begun=False, cut_off=False):
    return SimpleNamespace(length=length, restitution=restitution, begun=begun, cut_off=cut_off)


@pytest.mark.parametrize(
    ("within", "beyond", "told"),
    [
        ({}, {"begun": True}, "begins after touch"),
        ({}, {"cut_off": True}, "ends before release"),
        ({"offset": -4.99}, {"offset": -5.01}, "-0.5 % of the peak before touch"),
        ({"speed": 25.29}, {"speed": 25.31}, "the force implies 25.31 m/s, measured 25"),
        ({"speed": 26.0, "held": True}, {"speed": 24.6}, "calibration"),
        ({"tail": 7.999}, {"tail": 8.01}, "8.01 N (RMS) from the law outside"),
    ],
)
def test_what_a_record_leaves_in_doubt_is_told_from_its_border_on(within, beyond, told) -> None:
    """A pulse of 1 kN; residuals of 1 N; 3 N and 0.5 % of the peak are let be outside."""

    def texts(**changes):
        speed = changes.get("speed", 25.0)
        time = np.arange(-20, 100) * 1e-4
        form = closed_form(mass=0.058, stiffness=4.5e4, damping=14.0, speed=speed)
        force = form.force(time)
        inside = slice(21, 60)
        force[: inside.start - 1] += changes.get("tail", 0.0)
        away = np.flatnonzero((np.arange(120) < 20) | (np.arange(120) >= 60))
        force[away[20:]] += changes.get("tail", 0.0)
        contact = SimpleNamespace(
            begun=changes.get("begun", False),
            cut_off=changes.get("cut_off", False),
            offset=changes.get("offset", 0.0),
            peak=1000.0,
            samples=inside,
            step=1e-4,
        )
        impact = SimpleNamespace(
            speed=25.0, force=SimpleNamespace(where="it", time=time, value=force)
        )
        problem = SimpleNamespace(
            impacts=[impact], contacts=[contact], masses=[0.058], title="it",
            held=changes.get("held", False),
            split=lambda x: (x[0], x[1], x[2:3], x[3:4]),
        )  # fmt: skip
        result = SimpleNamespace(
            warnings=(),
            estimates=np.array([4.5e4, 14.0, speed, 0.0]),
            standard_errors=np.array([1.0, 1.0, 0.1, changes.get("error", 0.0)]),
        )
        left = np.tile([1.0, -1.0], 20)
        return _speed_warnings(problem, result, left, 0.1)

    assert texts(**within) == []
    (text,) = texts(**beyond)
    assert told in text


@pytest.mark.parametrize(
    ("correlation", "size", "told"),
    [(0.299, 1.0, False), (0.301, 1.0, True), (0.9, 0.0999, False), (0.9, 0.1002, True)],
)
def test_neighbours_that_are_alike_are_told(correlation, size, told) -> None:
    """From three tenths on, where they are more than 1e-4 of the largest peak."""
    angle = 0.5 * np.arcsin(min(2.0 * correlation, 1.0))
    left = np.array([np.cos(angle), np.sin(angle)])
    if correlation > 0.5:
        left = np.ones(40)
    problem = SimpleNamespace(
        title="it", contacts=[SimpleNamespace(peak=1000.0), SimpleNamespace(peak=10.0)]
    )
    assert bool(_correlated(problem, left, size)) == told


# what is shown


def test_dataset_and_figure_show_the_fit() -> None:
    fit = fit_ball(campaign(3, repeats=1), MASS, speed_low=18.0, speed_high=33.0)
    data = fit.to_dataset()
    for variable in data.variables.values():
        assert variable.attrs["units"]
        assert variable.attrs["long_name"]
    np.testing.assert_allclose(data["kb"], [group.kb for group in fit.groups])
    assert data.attrs["stiffness_growth [1]"] == fit.fields()["stiffness_growth"].value
    form = closed_form(mass=MASS, stiffness=law(18.0)[0], damping=14.0, speed=18.0)
    assert float(data["restitution"][0]) == pytest.approx(form.restitution, abs=0.02)
    figure = ball_fit_figure(fit, "a ball")
    points = figure.axes[2].containers[0].lines[0]
    np.testing.assert_allclose(points.get_ydata(), 1e-3 * data["kb"])
    line = next(x for x in figure.axes[2].get_lines() if x.get_label() == "line")
    assert line.get_ydata()[0] == pytest.approx(45.0, rel=0.02)
    residuals = figure.axes[1].get_lines()[0].get_ydata()
    assert np.sqrt(np.mean(residuals**2)) == pytest.approx(fit.groups[0].rms, rel=1e-9)


def test_offset_before_anything_happens() -> None:
    """Known from twenty samples on, and only where noise does not explain it."""
    assert resting_offset(np.full(20, 0.5)) == 0.5
    assert resting_offset(np.full(19, 0.5)) == 0.0
    assert resting_offset(0.1 + np.tile([1.0, -1.0], 20)) == 0.0
    assert SPEED_SIGMA == 0.1  # m/s: Glynn et al. 2011 give speeds to that
