"""Where the noise is unknown, intervals and covariances are those of Student's t, exactly."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from drake_racket.identify.core.annealing import anneal
from drake_racket.identify.core.estimate import Estimate
from drake_racket.identify.core.intervals import profile, profile_interval
from drake_racket.identify.core.least_squares import fit
from drake_racket.identify.core.search import Search
from drake_racket.identify.report.directory import estimates_table
from drake_racket.identify.report.impacts import _by_output
from drake_racket.identify.strings.table_fit import TableFit
from drake_racket.io.errors import InputError
from tests.identify.test_fit import Linear

T = np.linspace(-1.0, 2.0, 15)
DESIGN = np.stack([np.ones(15), T], axis=1)


@pytest.fixture(scope="module")
def problem():
    noise = np.random.default_rng(4).normal(0.0, 0.3, 15)
    return Linear(DESIGN, DESIGN @ [1.0, 2.0] + noise)


def by_hand(problem):
    x, squares = np.linalg.lstsq(problem.design, problem.y)[:2]
    variance = float(squares[0]) / 13.0
    errors = np.sqrt(variance * np.diag(np.linalg.inv(DESIGN.T @ DESIGN)))
    return x, variance, stats.t.ppf(0.975, 13) * errors


def test_profiles_of_unknown_noise_are_the_textbooks_intervals(problem):
    result = fit(problem, starts=1)
    x, variance, half = by_hand(problem)
    assert result.residual_sigma == pytest.approx(np.sqrt(variance))
    np.testing.assert_allclose(result.confidence_intervals[1], [x[1] - half[1], x[1] + half[1]])
    low, high = profile_interval(problem, result, "p1")
    assert (low, high) == pytest.approx((x[1] - half[1], x[1] + half[1]), rel=1e-5)


def test_a_profile_is_in_units_of_the_estimated_variance(problem):
    result = fit(problem, starts=1)
    x, variance, half = by_hand(problem)
    curve = profile(problem, result, "p1", values=np.array([x[1] - half[1], x[1] + half[1]]))
    assert curve.threshold == pytest.approx(stats.t.ppf(0.975, 13) ** 2)
    np.testing.assert_allclose(curve.chi2, curve.threshold, rtol=1e-6)
    assert variance != pytest.approx(np.sqrt(variance), rel=0.1)  # else it would not tell


def test_known_noise_takes_the_normal_quantile(problem):
    known = Linear(problem.design, problem.y, sigma=np.full(15, 0.3))
    result = fit(known, starts=1)
    x, _, _ = by_hand(problem)
    half = 1.959964 * 0.3 * np.sqrt(np.linalg.inv(DESIGN.T @ DESIGN)[1, 1])
    ends = profile_interval(known, result, "p1")
    assert ends == pytest.approx((x[1] - half, x[1] + half), rel=1e-5)


def test_an_undetermined_parameter_has_no_covariance_with_any_other():
    design = np.stack([np.ones(15), T, 2.0 * T], axis=1)
    open_problem = Linear(design, design @ [1.0, 2.0, 1.0] + 0.1 * np.cos(7.0 * T))
    covariance = fit(open_problem, starts=1).covariance
    assert np.isinf(np.diag(covariance)[1:]).all()
    assert np.isfinite(covariance[0, 0])
    off = covariance[~np.eye(3, dtype=bool)]
    assert np.isnan(off).all()


def test_bad_noise_and_options_are_named(problem):
    one_bad = np.ones(15)
    one_bad[4] = -2.0
    with pytest.raises(InputError, match=r"sigma: got -2\.0"):
        fit(Linear(problem.design, problem.y, sigma=one_bad), starts=1)
    with pytest.raises(InputError, match="max_evaluations: got 0"):
        anneal(problem, max_evaluations=0)
    with pytest.raises(InputError, match="polish: got True; allowed: only with the method anneal"):
        Search(method="least-squares", polish=True)
    assert Search(method="annealing", polish=True).polish
    closest = fit(problem, starts=1, tolerance=1e-15)
    np.testing.assert_allclose(closest.estimates, by_hand(problem)[0], rtol=1e-8)
    assert anneal(problem, starts=1, max_evaluations=1).estimates.shape == (2,)


def test_a_table_of_estimates_has_bounds_where_the_fit_is_known(problem):
    result = fit(problem, starts=1)
    found = {"p0": Estimate(0.98, 0.1, (0.8, 1.2), "N"), "q": Estimate(2.0, 0.1, (1.8, 2.2), "N")}
    with_bounds, without = estimates_table(found, result), estimates_table(found)
    assert "-20 to 20" in next(line for line in with_bounds.splitlines() if "p0" in line)
    assert "-20 to 20" not in without
    assert "| q |" in with_bounds


def test_rms_of_each_point_and_speed():
    table = SimpleNamespace(points=np.array([5, 5, 2]), speeds=np.array([20.1, 30.0, 19.9]))
    fitted = SimpleNamespace(
        problem=SimpleNamespace(table=table),
        result=SimpleNamespace(residuals=np.array([3.0, -4.0, 1.0])),
    )
    assert TableFit.rms_by(fitted, "point") == pytest.approx({2.0: 1.0, 5.0: np.sqrt(12.5)})
    assert TableFit.rms_by(fitted, "speed") == pytest.approx({20.0: np.sqrt(5.0), 30.0: 4.0})


def test_misfit_by_output_is_fitted_less_measured():
    data = SimpleNamespace(
        outputs=[SimpleNamespace(name="kb", units="N/m")], values=np.array([[1.0], [3.0], [np.nan]])
    )
    fitted = SimpleNamespace(data=data, modelled=np.array([[4.0], [-2.0], [7.0]]))
    assert _by_output(fitted) == [("kb", "N/m", "2", f"{np.sqrt(17.0):.3g}")]
