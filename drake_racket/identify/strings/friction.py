"""Fits friction coefficients to the rebound angles of oblique impacts on the clamped head.

Glynn et al. 2011 fit mu1-mu3 to two stroke conditions at nine points. The residuals are modelled
less measured angles of rebound in degrees. A ball that stops sliding before it leaves carries away
no trace of mu but that it was large enough: the likelihood is flat from there on, so the intervals
are those of its profile, and may be open to one side. A measured rebound speed is not used.

Every coefficient has points of its own, so that each is determined by its impacts alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from drake_racket.engines.clamped.batch import Bed, Impacts, Rebounds, make_bed, make_impacts, run
from drake_racket.identify.core.intervals import profile_interval
from drake_racket.identify.core.least_squares import fit
from drake_racket.identify.core.problem import Parameter
from drake_racket.identify.core.result import FitResult
from drake_racket.identify.core.search import (
    Search,
    estimates,
    fingerprint,
    loose,
    search,
    short_title,
)
from drake_racket.identify.strings.angle_table import AngleTable
from drake_racket.identify.strings.table_fit import TableFit
from drake_racket.identify.strings.table_rows import beyond
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Report
from drake_racket.laws.compilation import HAS_NUMBA
from drake_racket.parameters.ball import BallParameters
from drake_racket.parameters.racket import RacketParameters

if TYPE_CHECKING:
    import xarray

Array: TypeAlias = NDArray[np.float64]

STEP = 4e-6
"""s: the friction is stiff where the ball has stopped sliding. Angles are then off by 2e-9 degrees
(friction by velocity) and 6e-6 degrees (by displacement)."""

BOUNDS = 0.02, 1.5
READINGS = ("velocity", "displacement")
SLIDING = 5.0
"""A ball slides when its tangential speed is this many times the friction's speed scale."""

LITTLE = 0.02
"""Change of mu that an error of 0.1 degrees makes; above it, the fit warns."""


@dataclass(frozen=True, eq=False)
class FrictionProblem:
    """Holds the rebound angles on one racket (`problem.Problem`).

    Attributes:
        table: the measurements.
        racket: string-bed, and which coefficient belongs to which point.
        ball: kb, cb and the scales of friction.
        parameters: the coefficients whose points were hit.
        reading: of the friction's direction (READINGS).

    """

    table: AngleTable
    racket: RacketParameters
    ball: BallParameters
    parameters: tuple[Parameter, ...]
    title: str
    reading: str = "velocity"
    step: float = STEP
    residual_unit: str = "deg"

    @property
    def sigma(self) -> Array | None:
        """Gives the table's standard deviations, (m,)."""
        return self.table.sigma

    @property
    def measured(self) -> Array:
        """Gives (m,) degrees, of rebound."""
        return self.table.angle

    @cached_property
    def _column(self) -> NDArray[np.int64]:
        """(m,) number of the parameter of each row."""
        names = [p.name for p in self.parameters]
        points = self.racket.friction.points.value
        return np.array([names.index(points[str(p)]) for p in self.table.points])

    @cached_property
    def _bed(self) -> Bed:
        return make_bed(self.racket)

    @cached_property
    def _impacts(self) -> Impacts:
        table = self.table
        return make_impacts(
            self.racket,
            self.ball,
            table.points,
            table.velocities,
            friction_reading=self.reading,
        )

    def outcome(self, x: Array, *, derivatives: bool) -> tuple[Rebounds, Impacts]:
        """The batch at coefficients x (n,)."""
        count, m = len(self.parameters) if derivatives else 0, len(self.table.points)
        balls = self._impacts.balls.copy()
        balls[:, 2] = np.asarray(x)[self._column]
        sensitivity = np.zeros((m, 3, count))
        if derivatives:
            sensitivity[np.arange(m), 2, self._column] = 1.0
        impacts = replace(self._impacts, balls=balls, sensitivity=sensitivity)
        bed = replace(self._bed, sensitivity=np.zeros((*self._bed.constants.shape, count)))
        return run([bed], impacts, step=self.step), impacts

    def residuals(self, x: Array) -> Array:
        """Gives (m,) degrees; nan where the ball does not come away, and where x is nan.

        The search asks for that where no coefficient has any effect and its step is 0 / 0.
        """
        if np.isnan(x).any():
            return np.full(len(self.table.points), np.nan)
        outcome, impacts = self.outcome(x, derivatives=False)
        angle = np.degrees(outcome.rebound_angle(impacts)[0])
        return np.where(outcome.ended, angle - self.measured, np.nan)

    def jacobian(self, x: Array) -> Array:
        """Gives (m, n) degrees; 0 where the ball has stopped sliding to rounding.

        Friction proportional to the sliding speed, as it is near 0, leaves derivatives of 1e-100
        and less: squared they are no numbers.
        """
        outcome, impacts = self.outcome(x, derivatives=True)
        slopes = np.degrees(outcome.rebound_angle(impacts)[1])
        return np.where(np.abs(slopes) > 1e-100, slopes, 0.0)

    def fingerprint(self) -> str:
        """Gives the hash of the data, the racket, the ball and the kernel's settings."""
        table = self.table
        arrays = [table.points, table.velocities, table.angle, table.sigma]
        settings = f"rebound angle {self.reading} {self.step!r} {HAS_NUMBA}"
        return fingerprint(self.racket, self.ball, arrays, settings)


@dataclass(frozen=True, eq=False, kw_only=True)
class FrictionFit(TableFit[FrictionProblem]):
    """Holds the fitted coefficients of friction; its RMS is in degrees.

    Attributes:
        sliding: (m,) whether the ball still slides when it leaves, by the fitted model.
        sensitivity: by name: degrees of rebound angle per 0.01 of mu, root mean square.

    """

    sliding: NDArray[np.bool_]
    sensitivity: dict[str, float]

    def to_dataset(self) -> xarray.Dataset:
        """Gives the result with measured and modelled angles over `measurement`."""
        table = self.problem.table
        labels = {"incidence": (table.incidence, "deg"), "azimuth": (table.azimuth, "deg")}
        found = self._dataset("rebound_angle", "rebound angle from the normal", labels)
        text = {"units": "1", "long_name": "1 where the ball slides until it leaves"}
        found["sliding"] = ("measurement", self.sliding.astype(int), text)
        return found


def fit_friction(
    table: AngleTable,
    racket: RacketParameters,
    ball: BallParameters,
    *,
    start: Mapping[str, float] | None = None,
    bounds: tuple[float, float] = BOUNDS,
    reading: str = "velocity",
    options: Search | None = None,
    checkpoint: str | Path | None = None,
    progress: Report | None = None,
) -> FrictionFit:
    """Fits the coefficients of the points that were hit.

    Args:
        table: as `angle_table.read_angles` gives it, averaged or not.
        racket, ball: what is not fitted, and the first guess.
        start: values to begin at, by name; the racket's where none is given.
        bounds: of every coefficient mu (1).
        reading: of the friction's direction (READINGS).
        options, checkpoint, progress: as `string_bed.fit_string_bed`.

    Raises:
        InputError: options or start values out of range, a start for a coefficient of no row, or
            fewer rows than coefficients.

    """
    checkpoint = None if checkpoint is None else Path(checkpoint)
    if reading not in READINGS:
        raise InputError("friction_reading", reading, ", ".join(READINGS))
    if not (np.isfinite(bounds).all() and 0.0 < bounds[0] < bounds[1] <= 5.0):
        raise InputError("bounds", bounds, "0 < lower < upper <= 5")
    parameters = _parameters(table, racket, start or {}, bounds)
    if len(table.points) < len(parameters):
        got = f"{len(table.points)} for {len(parameters)} coefficients"
        raise InputError(f"{table.where}: rows", got, "at least as many rows as coefficients")
    title = short_title(racket, [p.name for p in parameters])
    problem = FrictionProblem(table, racket, ball, parameters, title, reading)
    result = search(problem, options or Search(), checkpoint, progress)
    profiled = result.degrees_of_freedom > 0 and result.residual_sigma > 0.0
    intervals = None
    if profiled:
        with np.errstate(divide="ignore", invalid="ignore"):  # as in search.search
            intervals = [_interval(problem, result, i) for i in range(len(parameters))]
    found = estimates(result, intervals)
    outcome, _ = problem.outcome(result.estimates, derivatives=False)
    tangential = np.linalg.norm(outcome.values[:, :2], axis=1)
    sliding = tangential > SLIDING * ball.sliding_speed_scale.value
    slopes = problem.jacobian(result.estimates)
    sensitivity = {
        p.name: 0.01 * float(np.sqrt(np.mean(slopes[problem._column == i, i] ** 2)))
        for i, p in enumerate(parameters)
    }
    warnings = [*table.warnings, *beyond(-table.velocities[:, 2], ball)]
    warnings += [*result.warnings, *loose(found)]
    warnings += _warnings(problem, sliding, sensitivity)
    return FrictionFit(
        problem=problem,
        result=result,
        estimates=found,
        profiled=profiled,
        sliding=sliding,
        sensitivity=sensitivity,
        warnings=tuple(dict.fromkeys(warnings)),
    )


def _interval(problem: FrictionProblem, result: FitResult, i: int) -> tuple[float, float]:
    """95 % interval of one coefficient from the profile over its own impacts.

    The others have no part in these. Where the noise was estimated, from all residuals, it enters
    as known but widened by the ratio of Student's to the normal quantile.
    """
    own, table = problem._column == i, problem.table
    sigma = table.sigma
    if sigma is None or result.rescaled:
        quantiles = stats.t.ppf(0.975, result.degrees_of_freedom) / stats.norm.ppf(0.975)
        given = np.ones(len(own)) if sigma is None else sigma
        sigma = given * result.residual_sigma * quantiles
    parameter = problem.parameters[i]
    at = float(result.estimates[i])
    if not parameter.lower < at < parameter.upper:
        at = parameter.start
    part = replace(
        problem,
        table=replace(table.rows(own), sigma=sigma[own]),
        parameters=(replace(parameter, start=at),),
    )
    return profile_interval(part, fit(part, starts=1), parameter.name)


def _parameters(
    table: AngleTable,
    racket: RacketParameters,
    start: Mapping[str, float],
    bounds: tuple[float, float],
) -> tuple[Parameter, ...]:
    points, own = racket.friction.points.value, racket.friction.coefficients.value
    names = sorted({points[str(p)] for p in table.points}, key=lambda name: int(name[2:]))
    for name in start:
        if name not in names:
            raise InputError("start", name, f"a coefficient that was measured: {', '.join(names)}")
    values = {name: start.get(name, own[int(name[2:]) - 1]) for name in names}
    return tuple(Parameter(name, "1", *bounds, value) for name, value in values.items())


def _warnings(
    problem: FrictionProblem, sliding: NDArray[np.bool_], sensitivity: Mapping[str, float]
) -> list[str]:
    found = []
    if not sliding.all():
        found.append(
            f"in {int((~sliding).sum())} of {len(sliding)} impacts the ball stops sliding before "
            "it leaves: its angle then tells a least value of mu at most"
        )
    for name, slope in sensitivity.items():
        if slope <= 0.0 or 0.1 / slope * 0.01 > LITTLE:
            change = f"by {0.001 / slope:.2g}" if slope > 1e-9 else "over its whole range"
            found.append(f"{name}: an error of 0.1 deg in all its rebound angles moves it {change}")
    missing = sorted(
        set(problem.racket.friction.points.value.values()) - {p.name for p in problem.parameters}
    )
    if missing:
        found.append(f"no impact at the points of {', '.join(missing)}: not fitted")
    return found
