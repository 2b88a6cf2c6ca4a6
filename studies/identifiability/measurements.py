"""What can be measured of a string-bed on a clamped head, its errors, and its derivatives.

Each kind of measurement is a `Block`: predicted values, standard deviations and derivatives with
respect to the logarithms of the parameters, so that a standard error of 0.1 is one of 10 %.
Impacts come from `clamped`. The static kinds solve F e_p + f(z) = 0 (`rigs.static_stiffness`); by
the implicit function theorem, with K the tangent stiffness and S = T dz/L the springs' forces,

    dz/dtheta = -K^-1 A^T dS/dtheta.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_racket import BallParameters, InputError, RacketParameters
from drake_racket.engines import Array, Bed, Rebounds, bed_parameters, make_bed, make_impacts, run
from drake_racket.laws import POINT_NUMBERS, generalized_forces, spring_partials
from drake_racket.rigs import CANNON_SPEEDS, MOST_FORCE, tangent_stiffness

QUANTITIES = ("restitution", "contact_time", "deflection", "static", "static_shape")
"""Of impacts: restitution, contact time, peak deflection of the string mass. Of the bed pressed
slowly: the deflection where it is pressed, or at all nine points."""

BALL_NAMES = ("kb", "cb")
"""The ball's, as common factors at all speeds: its slopes over speed are held."""


@dataclass(frozen=True)
class Errors:
    """Standard deviations of one reading; `repeats` impacts are averaged.

    The speeds' error and the number of repeats are printed (Glynn et al. 2011, Methods); that the
    first is a standard deviation, and all others, are inferred.

    Attributes:
        speed: m/s, of approach and of rebound speed.
        contact_time: s, as a film of 10,000 frames a second.
        deflection: m, of the strings' deepest point in an impact.
        static_deflection: m, of a string pressed slowly; read once.
        ball: relative, of kb and cb where they are known from elsewhere.

    """

    speed: float = 0.1
    repeats: float = 5.0
    contact_time: float = 5e-5
    deflection: float = 5e-4
    static_deflection: float = 1e-4
    ball: float = 0.01

    def __post_init__(self) -> None:
        for key, value in vars(self).items():
            if not (math.isfinite(value) and value > 0.0):
                raise InputError(key, value, "a finite positive number")


@dataclass(frozen=True)
class Design:
    """Where and how fast the ball strikes (m/s), and how hard the bed is pressed (N).

    Every point is struck at every speed and pressed with every force.
    """

    points: tuple[int, ...] = tuple(POINT_NUMBERS)
    speeds: tuple[float, ...] = tuple(CANNON_SPEEDS)
    forces: tuple[float, ...] = (100.0, 200.0, 400.0, 800.0)

    def __post_init__(self) -> None:
        if not self.points or not set(self.points) <= set(POINT_NUMBERS):
            raise InputError("points", list(self.points), "some of 1 to 9")
        if not self.speeds or not all(4.0 <= v <= 100.0 for v in self.speeds):
            raise InputError("speeds", list(self.speeds), "4 to 100 m/s, one or more")
        if not self.forces or not all(0.0 < f <= MOST_FORCE for f in self.forces):
            raise InputError("forces", list(self.forces), f"above 0 to {MOST_FORCE:g} N")

    @property
    def strikes(self) -> tuple[Array, Array]:
        """Points and speeds of the impacts, point by point."""
        return np.repeat(self.points, len(self.speeds)), np.tile(self.speeds, len(self.points))

    @property
    def loads(self) -> tuple[Array, Array]:
        """Points and forces of the static test, point by point."""
        return np.repeat(self.points, len(self.forces)), np.tile(self.forces, len(self.points))


@dataclass(frozen=True)
class Block:
    """Measurements of one kind.

    Attributes:
        values: (m,) predicted, in the unit of the kind (1, s or m).
        sigma: (m,) standard deviations.
        jacobian: (m, n) derivatives by the logarithms of the parameters.

    """

    values: Array
    sigma: Array
    jacobian: Array

    @property
    def scaled(self) -> Array:
        """(m, n) derivatives over the standard deviations."""
        return np.asarray(self.jacobian / self.sigma[:, None])


def all_names(racket: RacketParameters) -> tuple[str, ...]:
    """The bed's parameters, then `kb` and `cb`."""
    return (*bed_parameters(racket)[0], *BALL_NAMES)


def measure(
    racket: RacketParameters,
    ball: BallParameters,
    quantities: Sequence[str],
    *,
    design: Design | None = None,
    errors: Errors | None = None,
    values: Array | None = None,
    derivatives: bool = True,
) -> dict[str, Block]:
    """Predicts measurements with their errors.

    Args:
        quantities: some of QUANTITIES.
        values: the bed's parameters, as in `clamped.bed_parameters`; None: the racket's.
        derivatives: False leaves the blocks without columns, in a fraction of the time.

    Returns:
        Quantity -> Block; its columns are `all_names`.

    Raises:
        InputError: unknown quantity, or a bed off which the ball does not come.

    """
    design, errors = design or Design(), errors or Errors()
    for quantity in quantities:
        if quantity not in QUANTITIES:
            raise InputError("quantities", quantity, ", ".join(QUANTITIES))
    names, own = bed_parameters(racket)
    x = own if values is None else np.asarray(values, dtype=float)
    bed = make_bed(racket, values=x, free=names if derivatives else ())
    blocks: dict[str, Block] = {}
    if any(not q.startswith("static") for q in quantities):
        blocks |= _impact_blocks(racket, ball, bed, x, design, errors)
    if any(q.startswith("static") for q in quantities):
        blocks |= _static_blocks(bed, x, design, errors)
    return {q: blocks[q] for q in quantities}


def _impact_blocks(
    racket: RacketParameters,
    ball: BallParameters,
    bed: Bed,
    x: Array,
    design: Design,
    errors: Errors,
) -> dict[str, Block]:
    """Restitution, contact time and deflection of the impacts."""
    points, speeds = design.strikes
    count = bed.sensitivity.shape[2]
    extra = len(BALL_NAMES) if count else 0
    none = np.zeros((4, 24, extra))
    bed = dataclasses.replace(bed, sensitivity=np.concatenate([bed.sensitivity, none], axis=2))
    impacts = make_impacts(racket, ball, points, speeds, free=count + extra)
    for i in range(extra):  # d kb / d ln kb = kb
        impacts.sensitivity[:, i, count + i] = impacts.balls[:, i]
    outcome = run([bed], impacts)
    if not outcome.ended.all():
        raise InputError("values", x.tolist(), "a bed off which the ball comes")
    scale = np.concatenate([x, np.ones(extra)]) if count else np.ones(0)
    restitution, slopes = outcome.restitution(impacts)
    # rebound over approach speed, each with the same error
    single = errors.speed * np.sqrt(1.0 + restitution**2) / speeds
    mean = math.sqrt(errors.repeats)
    return {
        "restitution": Block(restitution, single / mean, slopes * scale),
        "contact_time": _column(outcome, "contact_time", errors.contact_time / mean, scale),
        "deflection": _column(outcome, "peak_deflection", errors.deflection / mean, scale),
    }


def _column(outcome: Rebounds, name: str, sigma: float, scale: Array) -> Block:
    values, slopes = outcome.column(name)
    return Block(values, np.full(len(values), sigma), slopes * scale)


def _static_blocks(bed: Bed, x: Array, design: Design, errors: Errors) -> dict[str, Block]:
    """Deflections of the bed pressed slowly; the ball has no part in them."""
    count = bed.sensitivity.shape[2]
    deflections, slopes = [], []
    points, forces = design.loads
    for point, force in zip(points, forces, strict=True):
        z = pressed(bed.constants, bed.topology.incidence, int(point), float(force))
        deflections.append(-z)
        if count:
            by_ball = np.zeros((9, len(BALL_NAMES)))
            slopes.append(np.hstack([-static_sensitivity(bed, z) * x, by_ball]))
    shape = np.stack(deflections)
    by = np.stack(slopes) if count else np.zeros((*shape.shape, 0))
    rows = np.arange(len(points)), points - 1
    sigma = errors.static_deflection
    here = Block(shape[rows], np.full(len(points), sigma), by[rows])
    everywhere = Block(shape.ravel(), np.full(shape.size, sigma), by.reshape(shape.size, -1))
    return {"static": here, "static_shape": everywhere}


def pressed(constants: Array, incidence: Array, point: int, force: float) -> Array:
    """Deflections (m) along the head's z, (points,), under `force` (N) along -z at `point`.

    Newton's method on a convex energy; a step is halved until the residual falls.

    Args:
        constants: (4, springs), incidence: (springs, points), see `strings.tensions`.

    Raises:
        ArithmeticError: no equilibrium found.

    """
    load, still = np.zeros((2, incidence.shape[1]))
    load[point - 1] = -force
    z, residual = still, load
    for _ in range(100):
        size = float(np.max(np.abs(residual)))
        if size <= 1e-10 * max(force, 1.0):
            return z
        step = np.linalg.solve(tangent_stiffness(z, constants, incidence), residual)
        part = 1.0
        while True:
            trial = load + generalized_forces(z + part * step, still, constants, incidence)
            if float(np.max(np.abs(trial))) < size or part < 1e-6:
                break
            part *= 0.5
        z, residual = z + part * step, trial
    raise ArithmeticError(f"no equilibrium found at point {point}: residual {size:g} N")


def static_sensitivity(bed: Bed, z: Array) -> Array:
    """dz/dtheta, (points, n), by the parameters of `bed.sensitivity`, at an equilibrium z."""
    k, slack, length2, c = bed.constants
    incidence = bed.topology.incidence
    _, _, _, by_k, by_slack, by_length2, by_c = spring_partials(
        incidence @ z, np.zeros(len(k)), k, slack, length2, c
    )
    partials = np.stack([by_k, by_slack, by_length2, by_c])
    forces = np.einsum("cs,csa->sa", partials, bed.sensitivity)
    stiffness = tangent_stiffness(z, bed.constants, incidence)
    return np.asarray(-np.linalg.solve(stiffness, incidence.T @ forces))
