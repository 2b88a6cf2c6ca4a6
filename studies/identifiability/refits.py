"""Does the linear answer of `identifiability` hold? Likelihood profiles, and real refits.

Both fit the bed's parameters, with the ball held, to measurements made by the model from a racket's
own parameters: without noise for profiles, so that they are those to expect; with normal noise, a
seed each, for refits.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from drake_racket import BallParameters, InputError, RacketParameters
from drake_racket.engines import Array, bed_parameters
from drake_racket.identify import Parameter, check_count, fit, profile
from studies.identifiability.cases import Case
from studies.identifiability.information import analyse
from studies.identifiability.measurements import Block, measure

if TYPE_CHECKING:
    import xarray

BOUND_FACTOR = 30.0
"""The bounds of a fit: this factor either side of the true values."""

WIDEST = 5.0
"""Largest factor from the true value to which a profile goes."""

_UNITS = {"T": "N", "k": "N/m", "p": "1"}


class BedProblem:
    """The bed's parameters from measurements made by the model; see `identify.problem.Problem`.

    Residuals are in standard deviations of the measurements, which may be of several kinds.
    """

    residual_unit = "standard deviations"

    def __init__(
        self,
        racket: RacketParameters,
        ball: BallParameters,
        case: Case,
        seed: int | None = None,
    ) -> None:
        """Seed: of the noise; None for none."""
        self.racket, self.ball, self.case, self.seed = racket, ball, case, seed
        names, self.truth = bed_parameters(racket)
        self.title = f"{racket.title}: {case.name}"
        self.parameters = tuple(
            Parameter(name, _UNITS[name[0]], x / BOUND_FACTOR, x * BOUND_FACTOR, x)
            for name, x in zip(names, self.truth.tolist(), strict=True)
        )
        values, self._scale = self._predict(self.truth)
        self.sigma = np.ones(len(values))
        self.measured = values / self._scale
        if seed is not None:
            self.measured += np.random.default_rng(seed).standard_normal(len(values))

    def residuals(self, x: Array) -> Array:
        """Model less measured, over the standard deviations, (m,)."""
        return np.asarray(self._predict(x)[0] / self._scale - self.measured)

    def jacobian(self, x: Array) -> Array:
        """Derivatives of the residuals, (m, n)."""
        blocks = self._measure(x, derivatives=True)
        rows = np.vstack([blocks[q].jacobian for q in self.case.quantities])
        return np.asarray(rows[:, : len(x)] / self._scale[:, None] / x)

    def fingerprint(self) -> str:
        """Hash of the data and of what is asked of them."""
        digest = hashlib.sha256(repr((self.case, asdict(self.racket), asdict(self.ball))).encode())
        digest.update(self.measured.tobytes())
        return digest.hexdigest()

    def _predict(self, x: Array) -> tuple[Array, Array]:
        """Values and standard deviations."""
        blocks = self._measure(x, derivatives=False)
        parts = [blocks[q] for q in self.case.quantities]
        return np.concatenate([b.values for b in parts]), np.concatenate([b.sigma for b in parts])

    def _measure(self, x: Array, *, derivatives: bool) -> dict[str, Block]:
        return measure(
            self.racket,
            self.ball,
            self.case.quantities,
            design=self.case.design,
            errors=self.case.errors,
            values=x,
            derivatives=derivatives,
        )


def profiles_dataset(
    racket: RacketParameters,
    ball: BallParameters,
    cases: Sequence[Case],
    names: Sequence[str],
    *,
    points: int = 7,
    progress: Callable[[str], None] | None = None,
) -> xarray.Dataset:
    """Likelihood profiles to expect: a parameter held off its true value, the others fitted.

    Args:
        names: of the parameters to hold.
        points: per profile, over 2.5 standard errors either side, WIDEST at most.
        progress: called with case and parameter before each profile.

    Returns:
        A Dataset over (case, parameter, step), with the bed's title as coordinate: ratio to the
        true value; chi2 above its minimum; chi2_linear, (ln ratio / standard error)^2.

    Raises:
        InputError: an unknown parameter, fewer than 3 points, or a ball that is not held.

    """
    import xarray

    check_count("points", points, 3)
    known = bed_parameters(racket)[0]
    for name in names:
        if name not in known:
            raise InputError("parameter", name, ", ".join(known))
    shape = len(cases), len(names), points
    ratio, chi2, linear = np.empty(shape), np.empty(shape), np.empty(shape)
    for i, case in enumerate(cases):
        errors = analyse(racket, ball, _held(case)).standard_errors
        problem = BedProblem(racket, ball, case)
        best = fit(problem, starts=1)
        for j, name in enumerate(names):
            if progress is not None:
                progress(f"{case.name}: {name}")
            at = known.index(name)
            half = min(2.5 * float(errors[at]), np.log(WIDEST))
            logs = np.linspace(-half, half, points)
            found = profile(problem, best, name, values=problem.truth[at] * np.exp(logs))
            ratio[i, j], chi2[i, j] = found.values / problem.truth[at], found.chi2
            linear[i, j] = (logs / errors[at]) ** 2
    over = ("case", "parameter", "step")
    return xarray.Dataset(
        {
            "ratio": (over, ratio, {"units": "1", "long_name": "held over true value"}),
            "chi2": (over, chi2, {"units": "1", "long_name": "chi squared above its minimum"}),
            "chi2_linear": (over, linear, {"units": "1", "long_name": "the same, linearised"}),
        },
        coords={
            "bed": ((), racket.title, _plain("string-bed")),
            "case": ("case", [c.name for c in cases], _plain("measurements")),
            "parameter": ("parameter", list(names), _plain("parameter that is held")),
            "step": ("step", np.arange(points), _plain("number of the point")),
        },
        attrs={"title": f"Likelihood profiles, {racket.title}"},
    )


def refits_dataset(
    racket: RacketParameters,
    ball: BallParameters,
    cases: Sequence[Case],
    *,
    repeats: int = 40,
    seed: int = 0,
    max_evaluations: int = 100,
    progress: Callable[[str], None] | None = None,
) -> xarray.Dataset:
    """Fits to noisy measurements, again and again, beside what the linear answer says.

    A fit starts from the true values and ends at a relative change of 1e-6; its noise is that of
    seed `seed`, `seed + 1`, ..

    Returns:
        A Dataset over (case, repeat, parameter): log_ratio, ln(estimate / true value);
        standard_error (case, parameter), the Cramer-Rao bound; converged (case, repeat).

    Raises:
        InputError: fewer than 2 repeats, a negative seed, or a ball that is not held.

    """
    import xarray

    check_count("repeats", repeats, 2)
    check_count("seed", seed, 0)
    names, truth = bed_parameters(racket)
    log_ratio = np.empty((len(cases), repeats, len(names)))
    converged = np.empty((len(cases), repeats), dtype=bool)
    errors = np.stack([analyse(racket, ball, _held(c)).standard_errors for c in cases])
    for i, case in enumerate(cases):
        for n in range(repeats):
            if progress is not None:
                progress(f"{case.name}: refit {n + 1} of {repeats}")
            problem = BedProblem(racket, ball, case, seed + n)
            found = fit(problem, starts=1, tolerance=1e-6, max_evaluations=max_evaluations)
            log_ratio[i, n] = np.log(found.estimates / truth)
            converged[i, n] = found.convergence[0].converged
    text = "logarithm of estimate over true value"
    return xarray.Dataset(
        {
            "log_ratio": (("case", "repeat", "parameter"), log_ratio, _plain(text)),
            "standard_error": (("case", "parameter"), errors, _plain("Cramer-Rao standard error")),
            "converged": (("case", "repeat"), converged, _plain("whether the fit converged")),
        },
        coords={
            "case": ("case", [c.name for c in cases], _plain("measurements")),
            "parameter": ("parameter", names, _plain("parameter")),
            "repeat": ("repeat", np.arange(repeats), _plain("number of the refit")),
        },
        attrs={"title": f"Refits, {racket.title}", "seed": seed},
    )


def _held(case: Case) -> Case:
    if case.ball != "held":
        raise InputError("ball", case.ball, "held, in profiles and refits")
    return case


def _plain(text: str) -> dict[str, str]:
    return {"units": "1", "long_name": text}
