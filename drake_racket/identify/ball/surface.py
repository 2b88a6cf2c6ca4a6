"""Fits friction and shear of a ball on strings to rebound angles and spins after: mu, kt, ct, chi.

Residuals are modelled less measured angles (degrees) and spins (rpm), each over its standard
deviation; impacts run in the clamped engine (`engines.clamped.spinning`), with one mu at all
points, or one for each group of points that the racket's file has (`mu1`, `mu2`, ...). Derivatives
are central differences of runs whose events are located, good to six digits.

Where balls grip, neither angle nor spin depends on mu: the fit says so. `expected_errors` tells
before an experiment what its impacts would determine.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from drake_racket.engines.clamped.batch import Bed, make_bed
from drake_racket.engines.clamped.spinning import (
    SpinningImpacts,
    SpinningRebounds,
    run_spinning,
    spinning_impacts,
)
from drake_racket.identify.ball.spins import SpinTable
from drake_racket.identify.core.estimate import Estimate
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
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Report
from drake_racket.laws.places import bed_weights
from drake_racket.laws.surface import SurfaceModel
from drake_racket.parameters.ball import BallParameters, surface_of
from drake_racket.parameters.racket import RacketParameters
from drake_racket.parameters.scenario import RPM
from drake_racket.plant.contacts import surface_model

Array: TypeAlias = NDArray[np.float64]

BOUNDS: Mapping[str, tuple[str, float, float]] = {
    "mu": ("1", 0.05, 1.5),
    "kt": ("N/m", 2e3, 4e5),
    "ct": ("N*s/m", 2.0, 400.0),
    "chi": ("1", 0.0, 1.0),
}
"""What can be fitted: unit and bounds."""
FREE = ("mu", "kt", "ct")
DIFFERENCE = 1e-4
"""Length of the differences, as a share of a number (of 0.1 where it is less)."""
LITTLE = 0.1
"""Half the width of mu's 95 % interval, above which the fit warns."""


@dataclass(frozen=True, eq=False)
class SurfaceProblem:
    """Holds angles and spins on one racket (`problem.Problem`): (2 m,) values, angles first.

    Attributes:
        table: the measurements.
        racket, ball: all that is not fitted.
        parameters: some of BOUNDS.

    """

    table: SpinTable
    racket: RacketParameters
    ball: BallParameters
    parameters: tuple[Parameter, ...]
    title: str
    residual_unit: str = ""

    @property
    def sigma(self) -> Array:
        """Gives the standard deviations, (2 m,)."""
        return np.concatenate([self.table.angle_sd, self.table.spin_sd])

    @cached_property
    def points_of(self) -> dict[str, NDArray[np.int64]]:
        """Gives the points (from 0) that each fitted mu is of."""
        groups = friction_groups(self.racket)
        return {p.name: groups[p.name] for p in self.parameters if p.name in groups}

    def meets(self, name: str) -> NDArray[np.bool_]:
        """Tells in which impacts more than half of the friction where the ball meets is a mu's."""
        model, share = self._model, np.zeros(len(self.table))
        for i, (x, y) in enumerate(self.table.places):
            points, _, shares = bed_weights(model.grid, model.rim, x, y)
            share[i] = sum(shares[k] for k in range(4) if points[k] in self.points_of[name])
        return share > 0.5

    @cached_property
    def _bed(self) -> Bed:
        return make_bed(self.racket)

    @cached_property
    def _model(self) -> SurfaceModel:
        return surface_model(self.racket, self.ball)

    @cached_property
    def _impacts(self) -> SpinningImpacts:
        table = self.table
        slant, zero = np.radians(table.incidence), np.zeros(len(table))
        velocities = table.speeds[:, None] * np.stack([zero, np.sin(slant), -np.cos(slant)], axis=1)
        spins = np.stack([-table.spin * RPM, zero, zero], axis=1)
        return spinning_impacts(self.racket, self.ball, table.places, velocities, spins)

    def outcome(self, x: Array) -> SpinningRebounds:
        """Gives the batch at parameters x (n,), or at k of them (k, n), one after the other."""
        rows = np.atleast_2d(x)
        own, m = self._impacts, len(self.table)
        surfaces = np.tile(own.surfaces, (len(rows), 1))
        friction = np.tile(own.friction, (len(rows), 1))
        for j, parameter in enumerate(self.parameters):
            values = np.repeat(rows[:, j], m)
            if parameter.name in self.points_of:
                friction[:, self.points_of[parameter.name]] = values[:, None]
            else:
                surfaces[:, 1 + ("chi", "kt", "ct").index(parameter.name)] = values
        several = replace(
            own,
            places=np.tile(own.places, (len(rows), 1)),
            velocities=np.tile(own.velocities, (len(rows), 1)),
            spins=np.tile(own.spins, (len(rows), 1)),
            surfaces=surfaces,
            friction=friction,
        )
        return run_spinning(self._bed, self._model, self.ball.mass.value, several)

    def modelled(self, x: Array) -> Array:
        """Gives (k, 2 m) angles and spins at k sets of parameters; NaN where no ball comes away."""
        found = self.outcome(x)
        v = found.velocities
        angle = np.degrees(np.arctan2(v[:, 1], v[:, 2]))
        spin = -found.spins[:, 0] / RPM
        m = len(self.table)
        pair = [np.where(found.ended, y, np.nan).reshape(-1, m) for y in (angle, spin)]
        return np.concatenate(pair, axis=1)

    def residuals(self, x: Array) -> Array:
        """Gives (2 m,) degrees and rpm."""
        if np.isnan(x).any():
            return np.full(2 * len(self.table), np.nan)
        measured = np.concatenate([self.table.angle, self.table.spin_after])
        found: Array = self.modelled(x)[0] - measured
        return found

    def jacobian(self, x: Array) -> Array:
        """Gives (2 m, n) by central differences."""
        n = len(self.parameters)
        h = DIFFERENCE * np.maximum(np.abs(x), 0.1)
        sides = np.concatenate([x + np.diag(h), x - np.diag(h)])
        found = self.modelled(sides)
        slopes: Array = ((found[:n] - found[n:]) / (2.0 * h[:, None])).T
        return slopes

    def fingerprint(self) -> str:
        """Gives the hash of the data, the racket, the ball and what is fitted."""
        t = self.table
        arrays = [t.speeds, t.incidence, t.spin, t.places, t.angle, t.spin_after, self.sigma]
        names = ",".join(p.name for p in self.parameters)
        return fingerprint(self.racket, self.ball, arrays, f"surface {names}")


@dataclass(frozen=True, eq=False)
class SurfaceFit:
    """Holds the fitted numbers.

    Attributes:
        problem: what was fitted.  result: how it went.
        estimates: value, standard error and 95 % interval by name.
        sliding: (m,) share of each contact that the fitted ball slides.
        warnings: one line each.

    """

    problem: SurfaceProblem
    result: FitResult
    estimates: dict[str, Estimate]
    sliding: Array
    warnings: tuple[str, ...]


def fit_surface(
    table: SpinTable,
    racket: RacketParameters,
    ball: BallParameters,
    *,
    free: Sequence[str] = FREE,
    start: Mapping[str, float] | None = None,
    options: Search | None = None,
    checkpoint: str | Path | None = None,
    progress: Report | None = None,
) -> SurfaceFit:
    """Fits mu, or one for each group of points, kt, ct and chi, or some of them.

    Args:
        table: as `spins.read_spins` gives it.
        racket, ball: what is not fitted, and the first guess.
        free: names of what is fitted (BOUNDS); `mu1`, `mu2` ... for single groups of the racket's
            points in place of `mu` for all.
        start: values to begin at, by name, in SI units.
        options, checkpoint, progress: as `strings.string_bed.fit_string_bed`.

    Raises:
        InputError: unknown names, start values out of bounds, fewer values than parameters.

    """
    problem = surface_problem(table, racket, ball, free=free, start=start)
    if 2 * len(table) < len(problem.parameters):
        got = f"{len(table)} for {len(problem.parameters)} numbers"
        raise InputError(f"{table.where}: rows", got, "at least half as many rows as numbers")
    kept = None if checkpoint is None else Path(checkpoint)
    result = search(problem, options or Search(), kept, progress)
    found = estimates(result)
    outcome = problem.outcome(result.estimates)
    with np.errstate(invalid="ignore"):
        sliding = outcome.sliding_time / outcome.contact_time
    warnings = [*result.warnings, *loose(found), *_of_friction(problem, found, sliding)]
    return SurfaceFit(problem, result, found, sliding, tuple(dict.fromkeys(warnings)))


def surface_problem(
    table: SpinTable,
    racket: RacketParameters,
    ball: BallParameters,
    *,
    free: Sequence[str] = FREE,
    start: Mapping[str, float] | None = None,
) -> SurfaceProblem:
    """Makes the problem that `fit_surface` solves, which has the arguments (SI units).

    Raises:
        InputError: as `fit_surface`.

    """
    surface = surface_of(ball)
    usual = {
        "mu": float(np.mean(racket.friction_coefficients())),
        "kt": surface.tangential_stiffness.value,
        "ct": surface.tangential_damping.value,
        "chi": surface.flattening.value,
    }
    groups = [name for name in friction_groups(racket) if name != "mu"]
    usual |= dict(zip(groups, racket.friction.coefficients.value, strict=True))
    for name in [*free, *(start or {})]:
        if name not in usual:
            raise InputError("free", name, ", ".join([*BOUNDS, *groups]))
    if "mu" in free and any(name in groups for name in free):
        raise InputError("free", ", ".join(free), "mu, or mu of groups of points, not both")
    values = usual | dict(start or {})
    parameters = tuple(
        Parameter(name, *BOUNDS["mu" if name in groups else name], values[name]) for name in free
    )
    return SurfaceProblem(table, racket, ball, parameters, short_title(racket, list(free)))


def friction_groups(racket: RacketParameters) -> dict[str, NDArray[np.int64]]:
    """Gives the points (from 0) of each mu of a racket: `mu` of all, then those of its file."""
    points = racket.bed_topology().points
    groups = {"mu": np.arange(len(points))}
    for i in range(len(racket.friction.coefficients.value)):
        name = f"mu{i + 1}"
        own = [p - 1 for p in points if racket.friction.points.value[str(p)] == name]
        groups[name] = np.array(own, dtype=np.int64)
    return groups


def expected_errors(problem: SurfaceProblem, x: Array | None = None) -> dict[str, float]:
    """Gives the standard errors that the problem's impacts would leave, at its start or at x.

    Errors and `x` (k,) are in the units of the problem's parameters. A number that the impacts do
    not determine within its bounds has inf.
    """
    x = np.array([p.start for p in problem.parameters]) if x is None else x
    weighted = problem.jacobian(x) / problem.sigma[:, None]
    scale = np.array([p.upper - p.lower for p in problem.parameters])
    information = (weighted * scale).T @ (weighted * scale)
    try:
        variance = np.diag(np.linalg.inv(information))
    except np.linalg.LinAlgError:
        variance = np.full(len(x), np.inf)
    variance = np.where(variance > 0.0, variance, np.inf)
    share = np.sqrt(variance)
    errors = np.where(share < 1.0, scale * share, np.inf)
    return {p.name: float(e) for p, e in zip(problem.parameters, errors, strict=True)}


def _of_friction(
    problem: SurfaceProblem, found: Mapping[str, Estimate], sliding: Array
) -> list[str]:
    """Says where the data do not determine friction."""
    said = []
    for name in problem.points_of:
        low, high = found[name].interval
        if np.isfinite([low, high]).all() and 0.5 * (high - low) <= LITTLE:
            continue
        met = problem.meets(name)
        if not met.any():
            said.append(f"{name} is not determined: no impact meets its points")
            continue
        throughout = int(np.sum(sliding[met] > 1.0 - 1e-9))
        said.append(
            f"{name} is not determined: the ball slides throughout in {throughout} of"
            f" {int(met.sum())} impacts{'' if name == 'mu' else ' on its points'}, and where it"
            " grips neither angle nor spin depends on mu; impacts at 60 to 65 degrees from the"
            " normal would tell (docs/spin.md)"
        )
    return said
