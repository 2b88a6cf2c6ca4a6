"""Least squares, annealing, intervals and checkpoints on small problems with known answers."""

from __future__ import annotations

import contextlib
import hashlib
import inspect
import json
import multiprocessing
import os
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import optimize, stats

from drake_racket.identify.core import checkpoint as checkpoint_module
from drake_racket.identify.core.annealing import Chain, anneal
from drake_racket.identify.core.checkpoint import Checkpoint
from drake_racket.identify.core.covariance import uncertainty
from drake_racket.identify.core.intervals import profile, profile_interval
from drake_racket.identify.core.least_squares import fit
from drake_racket.identify.core.problem import Parameter, Scale
from drake_racket.identify.core.result import FitResult
from drake_racket.identify.core.search import Search
from drake_racket.identify.report import figures as pictures
from drake_racket.io.errors import InputError
from drake_racket.io.files import write_netcdf
from drake_racket.io.progress import Progress
from drake_racket.store import OtherComputation
from tests.conftest import ROOT

Array = NDArray[np.float64]
TRUE = np.array([5.0, 1.3, 0.5])


@dataclass
class Decay:
    """a exp(-b t) + c, with a pause and a tally of evaluations for what is killed."""

    t: Array
    y: Array
    sigma: Array | None = None
    parameters: tuple[Parameter, ...] = (
        Parameter("a", "V", 0.1, 50.0, 1.0),  # logarithmic, as is b
        Parameter("b", "1/s", 0.01, 20.0, 3.0),
        Parameter("c", "V", -5.0, 5.0, 1.0),
    )
    title: str = "decay"
    residual_unit: str = "V"
    pause: float = 0.0
    tally: Path | None = None

    def residuals(self, x: Array) -> Array:
        if self.tally is not None:
            with self.tally.open("a") as file:
                file.write("x")
        if self.pause:
            time.sleep(self.pause)
        return x[0] * np.exp(-x[1] * self.t) + x[2] - self.y

    def jacobian(self, x: Array) -> Array:
        e = np.exp(-x[1] * self.t)
        return np.stack([e, -x[0] * self.t * e, np.ones_like(e)], axis=1)

    def fingerprint(self) -> str:
        return hashlib.sha256(self.t.tobytes() + self.y.tobytes()).hexdigest()


@dataclass
class Linear:
    """design @ x - y."""

    design: Array
    y: Array
    sigma: Array | None = None
    bound: float = 20.0
    title: str = "linear"
    parameters: tuple[Parameter, ...] = field(init=False)

    def __post_init__(self) -> None:
        count = self.design.shape[1]
        box = [Parameter(f"p{i}", "N", -self.bound, self.bound, 1.0) for i in range(count)]
        self.parameters = tuple(box)

    def residuals(self, x: Array) -> Array:
        return self.design @ x - self.y

    def jacobian(self, x: Array) -> Array:
        return self.design

    def fingerprint(self) -> str:
        return hashlib.sha256(self.design.tobytes() + self.y.tobytes()).hexdigest()


def decay(seed: int = 1, count: int = 40, noise: float = 0.05, **options: Any) -> Decay:
    t = np.linspace(0.0, 4.0, count)
    random = np.random.default_rng(seed)
    y = TRUE[0] * np.exp(-TRUE[1] * t) + TRUE[2] + random.normal(0.0, noise, count)
    return Decay(t, y, **options)


def linear(columns: list[Array], x: list[float], **options: Any) -> Linear:
    design = np.stack(columns, axis=1)
    noise = np.random.default_rng(7).normal(0.0, 0.3, len(design))
    return Linear(design, design @ np.array(x) + noise, **options)


def same(one: FitResult, other: FitResult) -> bool:
    """Bit for bit, but for the time taken."""
    a, b = (json.loads(r.to_json()) | {"seconds": 0.0} for r in (one, other))
    return bool(a == b and one.estimates.tobytes() == other.estimates.tobytes())


T = np.linspace(0.0, 2.0, 15)
ONE = np.ones_like(T)


# estimates and covariance


def test_linear_problem_has_the_textbook_covariance() -> None:
    sigma = 0.2 + 0.1 * T
    problem = linear([ONE, T, T**2], [1.0, -2.0, 3.0], sigma=sigma)
    result = fit(problem, starts=3)
    weight = np.diag(sigma**-2.0)
    covariance = np.linalg.inv(problem.design.T @ weight @ problem.design)
    expected = covariance @ problem.design.T @ weight @ problem.y
    errors = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(result.estimates, expected, rtol=1e-8)
    np.testing.assert_allclose(result.covariance, covariance, rtol=1e-9)
    half = 1.959963984540054 * errors
    np.testing.assert_allclose(result.confidence_intervals[:, 1], expected + half, rtol=1e-8)
    np.testing.assert_allclose(result.correlation, covariance / np.outer(errors, errors), rtol=1e-9)
    assert result.rms == pytest.approx(np.sqrt(np.mean(result.residuals**2)), rel=1e-14)
    assert result.degrees_of_freedom == 12


def test_unknown_sigma_is_estimated_and_gives_student_intervals() -> None:
    problem = linear([ONE[:6], T[:6]], [1.0, -2.0])
    result = fit(problem, starts=2)
    expected, (square,), _, _ = np.linalg.lstsq(problem.design, problem.y)
    covariance = square / 4.0 * np.linalg.inv(problem.design.T @ problem.design)
    np.testing.assert_allclose(result.covariance, covariance, rtol=1e-9)
    half = 2.7764451051977987 * np.sqrt(np.diag(covariance))  # t table, 4 degrees of freedom
    np.testing.assert_allclose(result.confidence_intervals[:, 0], expected - half, rtol=1e-8)
    # a sigma that is only relative says the same, whatever its size
    relative = replace_sigma(problem, np.full(6, 1e3))
    again = fit(relative, starts=2, rescale_sigma=True)
    np.testing.assert_allclose(again.covariance, covariance, rtol=1e-9)
    np.testing.assert_allclose(again.confidence_intervals, result.confidence_intervals, rtol=1e-8)


def replace_sigma(problem: Linear, sigma: Array) -> Linear:
    return Linear(problem.design, problem.y, sigma, problem.bound)


def test_nonlinear_problem_agrees_with_minpack() -> None:
    problem = decay(sigma=np.full(40, 0.05))
    result = fit(problem)

    def model(t: Array, a: float, b: float, c: float) -> Array:
        return a * np.exp(-b * t) + c

    x, covariance = optimize.curve_fit(
        model, problem.t, problem.y, [4.0, 1.0, 0.0], problem.sigma, absolute_sigma=True
    )
    np.testing.assert_allclose(result.estimates, x, rtol=1e-6)
    np.testing.assert_allclose(result.covariance, covariance, rtol=1e-4)  # MINPACK differences
    assert not result.warnings
    assert len(result.convergence) == 8
    assert sum(r.evaluations for r in result.convergence) == result.evaluations


def test_residuals_larger_than_sigma_are_pointed_out() -> None:
    (warning,) = fit(decay(sigma=np.full(40, 0.02)), starts=2).warnings
    assert "larger than sigma" in warning
    (warning,) = fit(decay(sigma=np.full(40, 0.2)), starts=2).warnings
    assert "smaller than sigma" in warning


# what the data do not determine


def test_parameters_that_trade_off_are_undetermined_and_the_rest_is_right() -> None:
    problem = linear([T, 2.0 * T, ONE], [1.0, 2.0, -1.0], sigma=np.full(15, 0.3))
    result = fit(problem, starts=3)
    assert result.undetermined_parameters == ("p0", "p1")
    assert len(result.undetermined) == 1
    # p0 + 2 p1 counts: with p1 up by a tenth of its bounds' width p0 goes down by two
    assert "p0 by +4 N, p1 by -2 N" in result.undetermined[0]
    assert np.isinf(result.confidence_intervals[:2]).all()
    slim = np.stack([T, ONE], axis=1)
    x, covariance = np.linalg.lstsq(slim, problem.y)[0], 0.09 * np.linalg.inv(slim.T @ slim)
    assert result.degrees_of_freedom == 13
    assert result.estimates[2] == pytest.approx(x[1], rel=1e-7)
    assert result.estimates[0] + 2.0 * result.estimates[1] == pytest.approx(x[0], rel=1e-7)
    assert result.standard_errors[2] == pytest.approx(np.sqrt(covariance[1, 1]), rel=1e-6)
    assert np.isnan(result.correlation[0, 1])


def test_starts_at_the_same_rms_elsewhere_are_pointed_out() -> None:
    result = fit(linear([T, 2.0 * T], [1.0, 2.0]), starts=3)
    assert any("the same RMS at other values of p0, p1" in text for text in result.warnings)


def test_parameter_without_effect_is_undetermined() -> None:
    result = fit(linear([T, 0.0 * T], [1.0, 2.0]), starts=1)
    assert result.undetermined == ("the data do not determine p1",)
    assert np.isfinite(result.confidence_intervals[0]).all()
    assert np.isinf(result.confidence_intervals[1]).all()


def test_units_do_not_decide_what_is_determined() -> None:
    small, large = (linear([ONE, T * 10.0**e], [1.0, 2.0]) for e in (-9, 9))
    for problem in (small, large):
        assert fit(problem, starts=1).undetermined == ()


def test_fewer_values_than_parameters() -> None:
    few = linear([ONE[:2], T[:2], T[:2] ** 2], [1.0, 2.0, 3.0])
    result = fit(few, starts=1)
    assert np.isinf(result.confidence_intervals).all()
    assert any("no more measured values" in text for text in result.warnings)


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["upper", "lower"])
def test_active_bound_is_flagged_and_gets_no_interval(side: float) -> None:
    problem = linear([ONE, T], [1.0, 8.0 * side], sigma=np.full(15, 0.3), bound=5.0)
    result = fit(problem, starts=3)
    assert result.at_bounds == ("p1",)
    assert result.estimates[1] == pytest.approx(5.0 * side, abs=1e-5)
    assert np.isinf(result.confidence_intervals[1]).all()
    assert np.isfinite(result.confidence_intervals[0]).all()
    # the other one is where it fits best with this one at its bound
    best = np.mean(problem.y - 5.0 * side * T)
    assert result.estimates[0] == pytest.approx(best, abs=1e-4)
    assert any("p1 is at a bound" in text for text in result.warnings)


def test_all_parameters_at_bounds() -> None:
    result = fit(linear([ONE, T], [9.0, 8.0], sigma=np.full(15, 0.3), bound=5.0), starts=3)
    assert result.at_bounds == ("p0", "p1")
    assert np.isinf(result.standard_errors).all()


def test_data_without_noise_give_no_doubt() -> None:
    problem = decay(noise=0.0)
    result = fit(problem)
    np.testing.assert_allclose(result.estimates, TRUE, rtol=1e-9)
    assert result.rms < 1e-10
    assert not any("standard errors away" in text for text in result.warnings)


def test_rounding_of_residuals_is_no_step_from_the_minimum() -> None:
    """Nearly parallel columns make a step of rounding; the same step of real residuals counts."""
    design = np.stack([T, T + 1e-4 * T**2], axis=1)
    problem = Linear(design, design @ np.array([9.0, 8.0]))
    weakest = np.linalg.svd(design, full_matrices=False)[0][:, -1]
    for size, doubt in ((1e-11, False), (1e-3, True)):
        off = size * weakest
        at_bounds = np.zeros(2, dtype=bool)
        found = uncertainty(problem.parameters, TRUE[:2], off, design, None, at_bounds)
        assert bool(found.steps_away.max() > 0.1) == doubt


def test_interval_as_wide_as_the_bounds_is_pointed_out() -> None:
    problem = linear([ONE, T], [1.0, 2.0], sigma=np.full(15, 100.0))
    warnings = fit(problem, starts=1).warnings
    assert sum("as wide as its bounds" in text for text in warnings) == 2


# coverage


def repeats(count: int, known: bool) -> Iterator[tuple[Decay, FitResult]]:
    """Fits to seven values only, so that normal instead of Student quantiles would show (88 %)."""
    for seed in range(count):
        problem = decay(1000 + seed, 7, 0.02, sigma=np.full(7, 0.02) if known else None)
        problem.parameters = tuple(
            replace(p, start=float(x)) for p, x in zip(problem.parameters, TRUE, strict=True)
        )
        yield problem, fit(problem, starts=1, tolerance=1e-9)


def limits(count: int) -> tuple[float, float]:
    """How many of 95 % intervals may hold the true value, but for one case in a thousand."""
    least, most = stats.binom.ppf([5e-4, 1.0 - 5e-4], count, 0.95)
    return float(least), float(most)


@pytest.mark.parametrize("known", [True, False], ids=["sigma_known", "sigma_estimated"])
def test_true_values_are_inside_the_intervals_at_the_right_rate(known: bool) -> None:
    inside = np.zeros(3, int)
    for _, result in repeats(200, known):
        low, high = result.confidence_intervals.T
        inside += (low <= TRUE) & (high >= TRUE)
    least, most = limits(200)
    assert ((inside >= least) & (inside <= most)).all(), inside


@pytest.mark.slow
def test_profile_intervals_hold_the_true_value_at_the_right_rate() -> None:
    inside = 0
    for problem, result in repeats(100, known=False):
        low, high = profile_interval(problem, result, "b")
        inside += low <= TRUE[1] <= high
    least, most = limits(100)
    assert least <= inside <= most


# profiles


def test_profile_of_a_linear_problem_is_the_parabola_of_its_interval() -> None:
    problem = linear([ONE, T, T**2], [1.0, -2.0, 3.0], sigma=0.2 + 0.1 * T)
    result = fit(problem, starts=1)
    curve = profile(problem, result, "p1", points=5)
    away = (curve.values - result.estimates[1]) / result.standard_errors[1]
    np.testing.assert_allclose(curve.chi2, away**2, atol=1e-6)
    # the others follow: slope of the conditional mean of a normal distribution
    slope = result.covariance[0, 1] / result.covariance[1, 1]
    line = result.estimates[0] + slope * (curve.values - result.estimates[1])
    np.testing.assert_allclose(curve.estimates[:, 0], line, atol=1e-6)
    ends = profile_interval(problem, result, "p1")
    np.testing.assert_allclose(ends, result.confidence_intervals[1], rtol=1e-5)


def test_profile_interval_of_a_curved_problem_is_where_the_sum_of_squares_says() -> None:
    """Few noisy values: the interval is lopsided. One parameter held by brute force."""
    problem = decay(3, 8, 0.4, sigma=np.full(8, 0.4))
    result = fit(problem)

    def lowest(b: float) -> float:  # the others are linear, once b is given
        design = np.stack([np.exp(-b * problem.t), np.ones(8)], axis=1)
        x = np.linalg.lstsq(design, problem.y)[0]
        return float(np.sum((design @ x - problem.y) ** 2) / 0.16)

    best = result.values["b"]
    threshold = lowest(best) + 1.959963984540054**2
    expected = [
        optimize.brentq(lambda b: lowest(b) - threshold, *ends)
        for ends in ((0.1, best), (best, 8.0))
    ]
    found = profile_interval(problem, result, "b")
    np.testing.assert_allclose(found, expected, rtol=1e-4)
    low, high = result.confidence_intervals[1]
    assert found[1] - best > 1.2 * (best - found[0]), "lopsided, as"
    assert high - best == pytest.approx(best - low), "the other one is not"


def test_profile_that_never_rises_has_no_ends() -> None:
    problem = linear([T, 2.0 * T], [1.0, 2.0], sigma=np.full(15, 0.3))
    result = fit(problem, starts=1)
    assert profile_interval(problem, result, "p0") == (-np.inf, np.inf)
    curve = profile(problem, result, "p0", points=5)
    assert curve.values[0] == -20.0
    assert curve.values[-1] == 20.0
    np.testing.assert_allclose(curve.chi2, 0.0, atol=1e-6)


def test_profile_ends_where_the_model_has_no_solution() -> None:
    class Cliff(Decay):
        def residuals(self, x: Array) -> Array:
            return super().residuals(x) * (np.nan if x[1] > 1.31 else 1.0)

    base = decay(sigma=np.full(40, 0.05))
    problem = Cliff(base.t, base.y, base.sigma)
    problem.parameters = tuple(
        replace(p, start=float(x)) for p, x in zip(problem.parameters, TRUE, strict=True)
    )
    result = fit(problem, starts=1)
    assert profile_interval(problem, result, "b")[1] == pytest.approx(1.31, abs=1e-4)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda p, r: profile(p, r, "z"), "parameter: got 'z'; allowed: a | b | c"),
        (lambda p, r: profile(p, r, "b", values=np.array([99.0])), "b: got 99.0"),
        (lambda p, r: profile_interval(p, r, "b", confidence=95.0), "confidence: got 95.0"),
        (lambda p, r: profile_interval(decay(9), r, "b"), "a fit of the same problem"),
    ],
    ids=["name", "value", "confidence", "problem"],
)
def test_profile_refuses(call: Callable[[Decay, FitResult], object], text: str) -> None:
    problem = decay()
    result = fit(problem, starts=1)
    with pytest.raises(InputError, match=re.escape(text)):
        call(problem, result)


# starts and the search


def test_starts_are_within_bounds_and_the_first_is_the_problems() -> None:
    result = fit(decay(), starts=20)
    starts = np.array([r.start for r in result.convergence])
    np.testing.assert_allclose(starts[0], [1.0, 3.0, 1.0], rtol=1e-12)
    box = result.parameters
    assert (starts >= [p.lower for p in box]).all()
    assert (starts <= [p.upper for p in box]).all()
    # a Latin hypercube: 19 starts in 19 equal parts, of the logarithm where that is the scale
    for x, p in zip(starts[1:].T, box, strict=True):
        low, high = (np.log([p.lower, p.upper])) if p.name in "ab" else (p.lower, p.upper)
        part = ((np.log(x) if p.name in "ab" else x) - low) / (high - low) * 19.0
        assert sorted(part.astype(int)) == list(range(19))
    assert same(result, fit(decay(), starts=20))
    assert not np.array_equal(
        starts, [r.start for r in fit(decay(), starts=20, seed=1).convergence]
    )


def test_start_without_a_solution_is_recorded_and_another_one_wins() -> None:
    class Fragile(Decay):
        def residuals(self, x: Array) -> Array:
            return super().residuals(x) * (np.nan if x[1] > 2.0 else 1.0)

    base = decay()
    result = fit(Fragile(base.t, base.y))  # its own start is at 3
    first = result.convergence[0]
    assert not first.converged
    assert "no solution" in first.status
    np.testing.assert_allclose(result.estimates, fit(base).estimates, rtol=1e-5)
    json.loads(result.to_json())
    with pytest.raises(InputError, match="no solution"):
        fit(Fragile(base.t, base.y), starts=1)


def test_search_is_the_same_in_any_unit() -> None:
    """Residuals in volts or in units a milliard times larger."""
    one = fit(decay(), starts=2)

    class Giga(Decay):
        def residuals(self, x: Array) -> Array:
            return 1e-9 * super().residuals(x)

        def jacobian(self, x: Array) -> Array:
            return 1e-9 * super().jacobian(x)

    base = decay()
    other = fit(Giga(base.t, base.y), starts=2)
    np.testing.assert_allclose(other.estimates, one.estimates, rtol=1e-7)
    np.testing.assert_allclose(other.covariance, one.covariance, rtol=1e-6)


def test_annealing_finds_the_minimum_that_least_squares_finds() -> None:
    problem = decay()
    expected = fit(problem)
    polished = anneal(problem, starts=2, max_evaluations=800, polish=True)
    np.testing.assert_allclose(polished.estimates, expected.estimates, rtol=1e-6)
    plain = anneal(problem, starts=2, max_evaluations=800)
    assert plain.evaluations == 1600
    assert expected.rms < plain.rms < 5.0 * expected.rms
    assert any("standard errors away" in text for text in plain.warnings)
    assert plain.rms == min(record.rms for record in plain.convergence)
    for chain, descended in zip(plain.convergence, polished.convergence, strict=True):
        number, rms = descended.history.T
        assert rms[number == 801] == pytest.approx(chain.rms, rel=1e-9), "polished from there"
        # where it stopped is the best point it saw
        assert chain.history[-1, 1] == chain.rms
        assert (np.diff(chain.history[:, 1]) < 0.0).all()


def test_annealing_left_alone_is_that_of_a_search_left_alone() -> None:
    own = {name: p.default for name, p in inspect.signature(anneal).parameters.items()}
    options = Search(method="annealing")
    assert (own["starts"], own["seed"], own["workers"]) == (options.starts, options.seed, 1)
    assert (own["max_evaluations"], own["temperature"]) == (
        options.evaluations,
        options.temperature,
    )
    assert (own["polish"], own["rescale_sigma"]) == (options.polish, options.rescale)


def test_annealing_chains_are_apart_and_the_best_is_kept() -> None:
    one, several = (anneal(decay(), starts=n, seed=1, max_evaluations=60) for n in (1, 4))
    first, *others = several.convergence
    np.testing.assert_array_equal(first.history, one.convergence[0].history)
    assert [p.start for p in decay().parameters] == pytest.approx(first.start, rel=1e-12)
    assert len({record.rms for record in several.convergence}) == 4
    assert not any(np.array_equal(record.start, first.start) for record in others)
    best = min(several.convergence, key=lambda record: record.rms)
    assert several.rms == best.rms < one.rms
    np.testing.assert_array_equal(several.estimates, best.estimates)
    other = anneal(decay(), seed=2, starts=1, max_evaluations=60)
    assert other.rms != one.rms


def test_chains_have_random_numbers_of_their_own() -> None:
    """From one and the same start."""

    def history(number: int) -> Array:
        chain = Chain(
            problem=decay(),
            number=number,
            point=np.full(3, 0.5),
            checkpoint=None,
            seed=1,
            temperature=500.0,
            max_evaluations=40,
            polish=False,
        )
        return chain.run(lambda _done, _rms: None).record.history

    np.testing.assert_array_equal(history(0), history(0))
    assert not np.array_equal(history(0), history(1))


def test_chain_without_a_solution_at_its_start_is_left_out() -> None:
    class Half(Decay):
        def residuals(self, x: Array) -> Array:
            return super().residuals(x) if x[2] < 2.5 else np.full_like(self.y, np.inf)

    base = decay()
    found = anneal(Half(base.t, base.y), starts=4, max_evaluations=60, polish=True)
    lost = [record for record in found.convergence if not record.converged]
    assert len(lost) == 1, "one of three chains spread over c = -5 to 5 begins above 2.5"
    assert lost[0].status == "the model has no solution there"
    assert np.isinf(lost[0].cost)
    assert np.isfinite(found.rms)


def test_progress_goes_from_nothing_to_one_and_the_rms_never_rises() -> None:
    for run in (
        lambda show: fit(decay(), starts=3, progress=show),
        lambda show: anneal(decay(), starts=2, max_evaluations=50, polish=True, progress=show),
    ):
        seen: list[tuple[float, float]] = []
        result = run(lambda now, seen=seen: seen.append((now.done / now.total, now.rms)))
        done, rms = np.array(seen).T
        assert (np.diff(done) >= 0.0).all()
        assert done[0] < 0.1
        assert done[-1] == 1.0
        assert (np.diff(rms) <= 0.0).all()
        assert rms[-1] == result.rms


@pytest.mark.slow
def test_any_number_of_workers_gives_the_same_bits(tmp_path: Path) -> None:
    problem = decay()
    alone = fit(problem, starts=5)
    shared = fit(problem, starts=5, workers=2, checkpoint=tmp_path)
    assert same(alone, shared)
    assert same(alone, fit(problem, starts=5, checkpoint=tmp_path))
    alone = anneal(problem, starts=3, max_evaluations=60, polish=True)
    shared = anneal(problem, starts=3, max_evaluations=60, polish=True, workers=2)
    assert same(alone, shared)


def test_workers_need_a_problem_that_pickles() -> None:
    problem = decay()
    problem.residuals = lambda x: x  # type: ignore[method-assign]
    with pytest.raises(InputError, match="workers: got 2; allowed: 1"):
        fit(problem, workers=2)


# killed and resumed

RUNS: dict[str, Callable[..., FitResult]] = {
    "fit": lambda problem, **options: fit(problem, starts=3, **options),
    "annealing": lambda problem, **options: anneal(
        problem, starts=2, max_evaluations=40, polish=True, **options
    ),
}


@pytest.mark.parametrize("kind", RUNS)
def test_killed_run_goes_on_where_it_was(kind: str, tmp_path: Path) -> None:
    """SIGKILL at some evaluation; the rerun repeats at most the one that was under way."""
    run = RUNS[kind]
    undisturbed = run(decay())
    tally, checkpoint = tmp_path / "tally", tmp_path / "checkpoint"
    run(decay(tally=tally))
    whole = len(tally.read_text())
    tally.unlink()
    for at in (whole // 3, 2 * whole // 3):  # twice
        child = multiprocessing.get_context("fork").Process(
            target=run, args=(decay(tally=tally, pause=0.01),), kwargs={"checkpoint": checkpoint}
        )
        child.start()
        while not tally.exists() or len(tally.read_text()) < at:
            assert child.exitcode is None
            time.sleep(0.002)
        child.kill()
        child.join()
        assert child.exitcode == -signal.SIGKILL
        assert len(tally.read_text()) < whole
    resumed = run(decay(tally=tally), checkpoint=checkpoint)
    assert same(resumed, undisturbed)
    # an annealing chain's best point is evaluated again for its residuals, checkpoint or not
    ends = len(resumed.convergence) if kind == "annealing" else 0
    assert len(tally.read_text()) <= whole + 2 + ends
    count = len(tally.read_text())
    run(decay(tally=tally), checkpoint=checkpoint)  # finished: nothing else is evaluated
    assert len(tally.read_text()) - count == ends


SCRIPT = """
import sys
from pathlib import Path
from tests.identify.test_fit import decay
from drake_racket.identify.core.least_squares import fit

if __name__ == "__main__":
    out = Path(sys.argv[1])
    fit(decay(tally=out / "tally", pause=0.3), starts=4, workers=2, checkpoint=out / "checkpoint")
"""


@pytest.mark.slow
def test_workers_end_with_their_killed_parent_and_the_fit_is_resumed(tmp_path: Path) -> None:
    script, tally = tmp_path / "script.py", tmp_path / "tally"
    script.write_text(SCRIPT)
    root = ROOT
    parent = subprocess.Popen(
        [sys.executable, script, tmp_path], env={**os.environ, "PYTHONPATH": str(root)}
    )
    while not tally.exists() or len(tally.read_text()) < 8:
        assert parent.poll() is None
        time.sleep(0.02)
    parent.kill()
    parent.wait()
    time.sleep(1.0)
    count = len(tally.read_text())
    time.sleep(0.5)
    assert len(tally.read_text()) == count, "no worker goes on"
    problem = decay(tally=tally)
    resumed = fit(problem, starts=4, checkpoint=tmp_path / "checkpoint")
    assert same(resumed, fit(decay(), starts=4))
    assert len(tally.read_text()) <= resumed.evaluations + 2, "one under way in each worker"


def test_interrupted_run_keeps_its_checkpoint(tmp_path: Path) -> None:
    def stop(now: Progress) -> None:
        if now.done > 0.1:
            raise KeyboardInterrupt

    tally = tmp_path / "tally"
    with pytest.raises(KeyboardInterrupt):
        fit(decay(tally=tally), checkpoint=tmp_path / "j", progress=stop)
    resumed = fit(decay(tally=tally), checkpoint=tmp_path / "j")
    assert same(resumed, fit(decay()))
    assert len(tally.read_text()) == resumed.evaluations


def test_larger_budget_continues_an_annealing_run(tmp_path: Path) -> None:
    tally = tmp_path / "tally"
    anneal(decay(tally=tally), max_evaluations=40, checkpoint=tmp_path / "j")
    count = len(tally.read_text())
    longer = anneal(decay(tally=tally), max_evaluations=100, checkpoint=tmp_path / "j")
    assert same(longer, anneal(decay(), max_evaluations=100))
    assert len(tally.read_text()) - count <= 61 * 4


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, FitResult]:
    """A finished fit's checkpoint and its result."""
    directory = tmp_path_factory.mktemp("finished")
    result = fit(decay(), starts=1, checkpoint=directory)
    return directory / "start_00.sqlite", result


def records(path: Path) -> list[tuple[int, bytes, bytes, int]]:
    """What is in a checkpoint."""
    with contextlib.closing(sqlite3.connect(path)) as database:
        return database.execute("SELECT * FROM evaluations ORDER BY number").fetchall()


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_damaged_checkpoint_costs_evaluations_but_no_accuracy(
    finished: tuple[Path, FitResult], tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    whole, result = finished
    damaged = tmp_path_factory.mktemp("damaged") / whole.name
    shutil.copy(whole, damaged)
    count = len(records(whole))
    at = data.draw(st.integers(0, count - 1), label="record")
    with contextlib.closing(sqlite3.connect(damaged)) as database, database:
        if data.draw(st.booleans(), label="cut"):
            database.execute("DELETE FROM evaluations WHERE number = ?", (at,))
        else:
            column = data.draw(st.sampled_from(["point", '"values"']), label="column")
            query = f"SELECT {column} FROM evaluations WHERE number = ?"
            ((content,),) = database.execute(query, (at,))
            byte = data.draw(st.integers(0, len(content) - 1), label="byte")
            spoilt = content[:byte] + bytes([content[byte] ^ 0x41]) + content[byte + 1 :]
            change = f"UPDATE evaluations SET {column} = ? WHERE number = ?"
            database.execute(change, (spoilt, at))
    assert same(fit(decay(), starts=1, checkpoint=damaged.parent), result)
    assert records(damaged) == records(whole)


def test_a_log_that_a_power_cut_has_cut_costs_evaluations_but_no_accuracy(tmp_path: Path) -> None:
    """The write-ahead log ends anywhere: what is whole before that counts."""
    copy = tmp_path / "copy"
    path = tmp_path / "start_00.sqlite"

    def keep(now: Progress) -> None:
        if now.done == 1.0:  # the log is in the file, and gone
            return
        copy.mkdir(exist_ok=True)
        for file in tmp_path.glob("start_00.sqlite*"):
            shutil.copy(file, copy)

    result = fit(decay(), starts=1, checkpoint=tmp_path, progress=keep)
    whole = records(path)
    log = (copy / "start_00.sqlite-wal").read_bytes()
    for share in (0.0, 0.3, 0.6, 0.99):
        cut = tmp_path / f"cut_{share}"
        shutil.copytree(copy, cut)
        (cut / "start_00.sqlite-wal").write_bytes(log[: int(share * len(log))])
        assert same(fit(decay(), starts=1, checkpoint=cut), result)
        assert records(cut / path.name) == whole


def test_a_checkpoint_that_is_no_whole_file_is_refused_in_one_line(
    finished: tuple[Path, FitResult], tmp_path: Path
) -> None:
    content = finished[0].read_bytes()
    (tmp_path / "start_00.sqlite").write_bytes(content[: 2 * 4096])
    with pytest.raises(InputError, match="checkpoint") as caught:
        fit(decay(), starts=1, checkpoint=tmp_path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("again", "key"),
    [
        (lambda path: fit(decay(2), starts=1, checkpoint=path), "problem"),
        (lambda path: fit(decay(sigma=np.ones(40)), starts=1, checkpoint=path), "sigma"),
        (
            lambda path: fit(decay(), starts=1, tolerance=1e-8, checkpoint=path),
            "settings.tolerance",
        ),
        (lambda path: fit(changed_bounds(), starts=1, checkpoint=path), "parameters"),
    ],
    ids=["data", "sigma", "tolerance", "bounds"],
)
def test_another_fits_checkpoint_is_refused(
    again: Callable[[Path], FitResult], key: str, tmp_path: Path
) -> None:
    fit(decay(), starts=1, checkpoint=tmp_path)
    before = (tmp_path / "start_00.sqlite").read_bytes()
    with pytest.raises(OtherComputation, match=rf"{tmp_path}: {key}: got") as caught:
        again(tmp_path)
    assert "\n" not in str(caught.value)
    assert (tmp_path / "start_00.sqlite").read_bytes() == before


PROBLEM = """{top}
Array = np.ndarray
from drake_racket.identify.core.problem import Parameter
TRUE = np.array([5.0, 1.3, 0.5])

{made}
"""

LAW_SCRIPT = """
from pathlib import Path
from drake_racket.identify.core.least_squares import fit
from drake_racket.io.fingerprint import computation
from drake_racket.store import OtherComputation
from problem import decay

for changed in (
    "drake_racket/cli/console.py", "script.py", "drake_racket/laws/contact.py", "problem.py"
):
    file = Path(changed)
    before = file.read_text()
    file.write_text(before + "# another")
    computation.cache_clear()
    try:
        fit(decay(), starts=1, checkpoint=Path("checkpoint"))
    except OtherComputation as error:
        print(changed, error.key)
    file.write_text(before)
"""


def test_a_checkpoint_of_another_law_is_refused(tmp_path: Path) -> None:
    """Whatever the package's version says: a law's source, and the problem's own, count."""
    for name in ("drake_racket", "sdf"):
        shutil.copytree(ROOT / name, tmp_path / name)
    made = inspect.getsource(Decay) + "\n" + inspect.getsource(decay)
    top = Path(__file__).read_text().split("\nfrom drake_racket", 1)[0]
    (tmp_path / "problem.py").write_text(PROBLEM.format(top=top, made=made))
    (tmp_path / "script.py").write_text(LAW_SCRIPT)
    command = [sys.executable, "script.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    # the command line and a script around the fit decide no number
    refused = [line.split(maxsplit=1) for line in done.stdout.splitlines()]
    assert [changed for changed, _ in refused] == ["drake_racket/laws/contact.py", "problem.py"]
    assert all(key.endswith("computation.source") for _, key in refused)


def changed_bounds() -> Decay:
    problem = decay()
    problem.parameters = (*problem.parameters[:2], Parameter("c", "V", -6.0, 5.0, 1.0))
    return problem


def test_files_that_are_no_checkpoint_are_refused_and_kept(tmp_path: Path) -> None:
    file = tmp_path / "start_00.sqlite"
    file.write_text("my notes\n")
    with pytest.raises(InputError, match="a file that a fit can be kept in"):
        fit(decay(), starts=1, checkpoint=tmp_path)
    assert file.read_text() == "my notes\n"
    with pytest.raises(InputError, match="a directory"):
        fit(decay(), checkpoint=file)
    with pytest.raises(InputError, match="checkpoint: got"):
        fit(decay(), checkpoint=Path("/proc/nowhere"))


def test_checkpoint_of_other_values_in_another_order_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.sqlite"
    with Checkpoint(path, {"a": 1}) as checkpoint:
        checkpoint.value("residuals", np.array([1.0]), lambda: np.array([2.0]))
    with (
        pytest.raises(InputError, match="same computation"),
        Checkpoint(path, {"a": 1}) as checkpoint,
    ):
        checkpoint.value("residuals", np.array([1.0 + 1e-15]), lambda: np.array([2.0]))


def test_checkpoint_in_use_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checkpoint_module, "_LOCK_PATIENCE", 0.05)
    path = tmp_path / "a.sqlite"
    with Checkpoint(path, {}), pytest.raises(InputError, match="no other fit"):
        Checkpoint(path, {})
    Checkpoint(path, {}).close()


# bad input


@pytest.mark.parametrize(
    ("lower", "upper", "start"),
    [
        (0.0, np.inf, 1.0),
        (np.nan, 1.0, 0.5),
        (2.0, 1.0, 1.5),
        (1.0, 1.0, 1.0),
        (0.0, 1.0, 1.0),
        (0.0, 1.0, 0.0),
        (0.0, 1.0, np.nan),
        (0.0, 1.0, 5.0),
    ],
)
def test_bad_bounds_are_refused(lower: float, upper: float, start: float) -> None:
    with pytest.raises(InputError, match=r"kb: (bounds|start): got") as caught:
        Parameter("kb", "N/m", lower, upper, start)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"starts": 0}, "starts"),
        ({"seed": -1}, "seed"),
        ({"workers": 1.5}, "workers"),
        ({"max_evaluations": 0}, "max_evaluations"),
        ({"tolerance": 0.0}, "tolerance"),
        ({"tolerance": np.nan}, "tolerance"),
    ],
    ids=["starts", "seed", "workers", "max_evaluations", "zero", "nan"],
)
def test_bad_options_are_refused(options: dict[str, Any], key: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=f"^{key}: got"):
        fit(decay(), checkpoint=tmp_path / "j", **options)
    assert not (tmp_path / "j").exists()


def test_bad_problems_are_refused() -> None:
    for bad in (np.zeros(40), np.full(40, np.nan), np.full((40, 1), 0.1), np.full(39, 0.1)):
        with pytest.raises(InputError, match="sigma"):
            fit(decay(sigma=bad), starts=1)
    problem = decay()
    problem.parameters = problem.parameters[:2]
    with pytest.raises((InputError, IndexError)):
        fit(problem, starts=1)
    problem.parameters = problem.parameters[:1] * 2
    with pytest.raises(InputError, match="each name once"):
        anneal(problem)


# scales


@settings(max_examples=40, deadline=None)
@given(
    lower=st.floats(-1e6, 1e6).filter(lambda x: abs(x) > 1e-9),
    width=st.floats(1e-6, 1e9),
    part=st.floats(0.0, 1.0),
)
def test_scale_and_its_slope(lower: float, width: float, part: float) -> None:
    upper = lower + width
    if not lower < 0.5 * (lower + upper) < upper:
        return
    parameter = Parameter("p", "", lower, upper, 0.5 * (lower + upper))
    scale = Scale([parameter])
    x = scale.from_unit(np.array([part]))
    assert lower <= x[0] <= upper
    back = scale.from_unit(scale.to_unit(x))
    np.testing.assert_allclose(back, x, rtol=1e-9, atol=1e-9 * width)
    assert parameter.logarithmic == (lower > 0.0 and upper / lower > 10.0)
    if 0.01 < part < 0.99:
        step = 1e-5
        ends = [scale.from_unit(np.array([part + s * step])) for s in (-1, 1)]
        slope = (ends[1] - ends[0]) / (2.0 * step)
        np.testing.assert_allclose(scale.slope(x), slope, rtol=1e-4, atol=1e-7 * abs(lower) / step)


# what is handed on


def test_result_as_data_and_text() -> None:
    problem = decay(sigma=np.full(40, 0.05))
    result = fit(problem, starts=2)
    speed = np.repeat([20.0, 30.0], 20)
    data = result.to_dataset({"speed": (speed, "m/s"), "point": (["1", "2"] * 20, "")})
    for variable in data.variables.values():
        assert set(variable.attrs) >= {"units", "long_name"}
    assert data["residual"].attrs["units"] == "V"
    assert float(data["estimate"].sel(parameter="b")) == result.values["b"]
    assert float(data["residual"].groupby("speed").mean().sel(speed=20.0)) == pytest.approx(
        result.residuals[:20].mean()
    )
    content = json.loads(result.to_json())
    assert content["parameters"][1]["estimate"] == result.values["b"]
    best = min(content["convergence"], key=lambda record: record["cost"])
    assert best["history"][-1][1] == best["rms"] == content["rms"]
    assert set(content["versions"]) == {"drake", "drake-racket", "numpy", "numba", "scipy"}


def test_result_with_open_intervals_is_valid_json_and_a_file(tmp_path: Path) -> None:
    result = fit(linear([T, 0.0 * T], [1.0, 2.0]), starts=2)
    content = json.loads(result.to_json())
    assert content["parameters"][1]["confidence_interval_95"] == [None, None]
    write_netcdf(result.to_dataset(), tmp_path / "fit.nc")
    with xarray.open_dataset(tmp_path / "fit.nc") as data:
        assert np.isinf(data["confidence_interval"].sel(parameter="p1")).all()
        assert "do not determine p1" in data.attrs["undetermined"]


def test_pictures_name_their_units() -> None:
    problem = decay()
    result = fit(problem, starts=3)
    points = ["tip", "centre"] * 20
    figure = pictures.residual_figure(
        result, points, abscissa=problem.t, abscissa_label="time [s]", scale=1e3, unit="mV"
    )
    (axes,) = figure.axes
    assert axes.get_ylabel() == "model - measured [mV]"
    drawn = {line.get_label(): line.get_ydata() for line in axes.lines}
    np.testing.assert_allclose(drawn["tip"], 1e3 * result.residuals[::2])
    axes = pictures.starts_figure(result).axes[0]
    assert axes.get_ylabel() == "lowest RMS so far [V]"
    assert len([line for line in axes.lines if len(line.get_xdata()) > 1]) == 3
    texts = {text.get_text() for text in pictures.correlation_figure(result).axes[0].texts}
    assert f"{result.correlation[0, 1]:.2f}" in texts
