"""Runs batches of impacts on string-beds whose head is clamped: the fast rig under the fits.

`ode` has the equations. It is not a second model: the force laws are those of the
Drake systems, and a test ties a batch to the Drake rig (`rigs.head_clamped`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.engines.clamped.kernel import ENDED, OUTPUTS, TOUCHES, run_batch
from drake_racket.io.errors import InputError
from drake_racket.laws.bed import BedTopology
from drake_racket.laws.contact import FRICTION_READINGS, ball_constants
from drake_racket.parameters.ball import BallParameters
from drake_racket.parameters.racket import RacketParameters
from drake_racket.plant.ball import ball_law
from drake_racket.plant.string_bed import string_bed_model
from drake_racket.plant.systems.string_bed import StringBedModel, spring_constants

Array = NDArray[np.float64]
"""This is the type of the arrays here: NumPy's, of floats."""

STEP = 2e-5
"""s; see docs/identification.md for the error that it leaves."""


@dataclass(frozen=True)
class Bed:
    """A bed is a string-bed in numbers.

    Attributes:
        constants: (4, springs) of `strings.tensions`, SI units.
        mass: kg, of one of the string masses.
        sensitivity: (4, springs, n) derivatives of the constants with respect to n parameters.
        topology: its points and springs.

    """

    constants: Array
    mass: float
    sensitivity: Array
    topology: BedTopology

    def static_stiffness(self) -> Array:
        """Gives (points,) N/m at each point of the flat bed, all else unloaded: 1 / (K^-1)_pp."""
        k, slack, length2, _ = self.constants
        length, incidence = np.sqrt(length2), self.topology.incidence
        matrix = incidence.T @ (((slack + k * length) / length)[:, None] * incidence)
        return np.asarray(1.0 / np.diag(np.linalg.inv(matrix)))


@dataclass(frozen=True)
class Impacts:
    """The impacts of a batch say what is shot at the beds: m of them.

    Attributes:
        points: (m,) from 1.
        velocities: (m, 3) m/s of the ball in the head at touch; z negative.
        balls: (m, 9) kb, cb, mu, 0, 0, scale of the friction's reading, reading, hb, db:
            `contact_law`.
        ball_mass: kg.
        sensitivity: (m, 3, n) derivatives of kb, cb, mu.
        bed: (m,) index of the bed of each impact.

    """

    points: NDArray[np.int64]
    velocities: Array
    balls: Array
    ball_mass: float
    sensitivity: Array
    bed: NDArray[np.int64]


@dataclass(frozen=True)
class Rebounds:
    """What a batch gives; the columns of `values` are `OUTPUTS`.

    Attributes:
        values: (m, 6).  jacobian: (m, 6, n).
        touches: (m,) how often ball and strings met.
        ended: (m,) False where the ball never came out of reach: its values are no result.

    """

    values: Array
    jacobian: Array
    touches: NDArray[np.int64]
    ended: NDArray[np.bool_]

    def column(self, name: str) -> tuple[Array, Array]:
        """Gives values (m,) and derivatives (m, n) of one of OUTPUTS."""
        i = OUTPUTS.index(name)
        return self.values[:, i], self.jacobian[:, i]

    def restitution(self, impacts: Impacts) -> tuple[Array, Array]:
        """Gives normal rebound over normal approach speed (m,), and its derivatives (m, n)."""
        approach = -impacts.velocities[:, 2]
        values, slopes = self.column("v_z")
        return values / approach, slopes / approach[:, None]

    def rebound_angle(self, impacts: Impacts) -> tuple[Array, Array]:
        """Gives the angle (rad) from the normal (m,), as `rigs.head_clamped` signs it.

        The tangential part counts along the tangential direction of approach.
        """
        tangential = impacts.velocities[:, :2]
        direction = tangential / np.linalg.norm(tangential, axis=1, keepdims=True)
        along = np.sum(direction * self.values[:, :2], axis=1)
        d_along = np.einsum("mi,mia->ma", direction, self.jacobian[:, :2])
        normal, d_normal = self.column("v_z")
        square = along**2 + normal**2
        slope = normal[:, None] * d_along - along[:, None] * d_normal
        return np.arctan2(along, normal), slope / square[:, None]


def run(beds: Sequence[Bed], impacts: Impacts, *, step: float = STEP) -> Rebounds:
    """Simulates a batch, compiled and on all cores where numba is installed.

    Without numba the same code runs as plain Python, some five hundred times slower: 0.1 s for an
    impact, 1 s with the sensitivities of a fit.

    Args:
        beds: of one topology.
        step: s, of the Runge-Kutta steps.

    Raises:
        InputError: shapes or numbers that do not fit.

    """
    _check(beds, impacts, step)
    m, n = len(impacts.points), impacts.sensitivity.shape[2]
    out, jacobian = np.zeros((m, 8)), np.zeros((m, len(OUTPUTS), n))
    run_batch(
        impacts.bed,
        impacts.points - 1,
        impacts.velocities,
        beds[0].topology.ends,
        np.stack([bed.constants for bed in beds]),
        impacts.balls,
        np.array([(impacts.ball_mass, bed.mass) for bed in beds]),
        np.stack([bed.static_stiffness() for bed in beds]),
        np.stack([bed.sensitivity for bed in beds]),
        impacts.sensitivity,
        step,
        out,
        jacobian,
    )
    return Rebounds(out[:, :6], jacobian, out[:, TOUCHES].astype(np.int64), out[:, ENDED] > 0.5)


def _check(beds: Sequence[Bed], impacts: Impacts, step: float) -> None:
    if not beds or any(bed.topology.names != beds[0].topology.names for bed in beds):
        raise InputError("beds", [len(bed.topology.names) for bed in beds], "beds of one topology")
    most, springs = len(beds[0].topology.points), len(beds[0].topology.names)
    m, n = len(impacts.points), impacts.sensitivity.shape[-1]
    shapes = {
        "velocities": (impacts.velocities, (m, 3)),
        "balls": (impacts.balls, (m, 9)),
        "sensitivity": (impacts.sensitivity, (m, 3, n)),
        "bed": (impacts.bed, (m,)),
    }
    shapes |= {f"beds[{i}].constants": (bed.constants, (4, springs)) for i, bed in enumerate(beds)}
    shapes |= {
        f"beds[{i}].sensitivity": (bed.sensitivity, (4, springs, n)) for i, bed in enumerate(beds)
    }
    for key, (array, shape) in shapes.items():
        if array.shape != shape:
            raise InputError(key, f"an array of shape {array.shape}", f"shape {shape}")
        if not np.isfinite(array).all():
            raise InputError(key, "a number that is not finite", "finite numbers")
    _check_points(impacts.points, most)
    if not ((impacts.bed >= 0) & (impacts.bed < len(beds))).all():
        raise InputError("bed", impacts.bed.tolist(), f"0 to {len(beds) - 1}")
    if not (impacts.velocities[:, 2] < 0.0).all():
        raise InputError("velocities", "z of 0 or more", "a ball that comes towards -z")
    if not 1e-7 <= step <= 1e-4:
        raise InputError("step", step, "1e-7 to 1e-4 s")


def _check_points(points: NDArray[np.int64], most: int) -> None:
    if not ((points >= 1) & (points <= most)).all():
        raise InputError("points", points.tolist(), f"1 to {most}")


def bed_parameters(racket: RacketParameters) -> tuple[list[str], Array]:
    """Names a bed's fitted parameters, `T0`, `k1`.., `p1`.., and gives their values (N, N/m, 1)."""
    bed = racket.string_bed
    k, p = bed.stiffness.value, bed.rim_factors.value
    names = ["T0", *(f"k{i + 1}" for i in range(len(k))), *(f"p{i + 1}" for i in range(len(p)))]
    return names, np.array([bed.initial_tension.value, *k, *p])


def make_bed(racket: RacketParameters, values: Any = None, free: Sequence[str] = ()) -> Bed:
    """Makes a racket's bed, its parameters replaced by `values`, in the order of `bed_parameters`.

    Args:
        free: names of the parameters to differentiate with respect to, in the order wanted.

    Raises:
        InputError: values of another shape, or an unknown name.

    """
    names, own = bed_parameters(racket)
    x = own if values is None else np.asarray(values, dtype=float)
    if x.shape != own.shape:
        raise InputError("values", f"an array of shape {x.shape}", ", ".join(names))
    model = string_bed_model(racket)
    count = len(model.stiffness)
    model = replace(
        model,
        stiffness=x[1 : 1 + count],
        rim_factors=x[1 + count :],
        initial_tension=float(x[0]),
    )
    sensitivity = np.zeros((4, len(model.lengths), len(free)))
    for a, name in enumerate(free):
        if name not in names:
            raise InputError("free", name, ", ".join(names))
        sensitivity[:2, :, a] = _by_parameter(model, names.index(name), count)
    return Bed(spring_constants(model), racket.string_mass(), sensitivity, model.topology)


def _by_parameter(model: StringBedModel, index: int, count: int) -> Array:
    """d(k, T0 - k L0) of the m springs by one parameter, (2, m); k = k_i p_j."""
    if index == 0:
        return np.stack([np.zeros_like(model.lengths), np.ones_like(model.lengths)])
    factors = np.append(model.rim_factors, 1.0)[model.rim_factor_index]
    if index <= count:
        by_k = np.where(model.stiffness_index == index - 1, factors, 0.0)
    else:
        own = model.rim_factor_index == index - 1 - count
        by_k = np.where(own, model.stiffness[model.stiffness_index], 0.0)
    return np.stack([by_k, -by_k * model.lengths])


def make_impacts(
    racket: RacketParameters,
    ball: BallParameters,
    points: Any,
    velocities: Any,
    *,
    free: int = 0,
    bed: Any = None,
    friction_reading: str = "velocity",
    friction: Any = None,
) -> Impacts:
    """Makes impacts with the ball's constants at their speeds and the friction of their points.

    Args:
        points: (m,) from 1.  velocities: (m, 3) m/s, z negative; or (m,) normal speeds.
        free: number of free parameters of the beds; their derivatives of kb, cb, mu are 0.
        bed: (m,) index of the bed of each impact; all on the first if None.
        friction: coefficients at all points in place of the racket's.

    Raises:
        InputError: an unknown reading, or a point that the bed does not have.

    """
    if friction_reading not in FRICTION_READINGS[:2]:
        allowed = f"{', '.join(FRICTION_READINGS[:2])} (an element: run_spinning)"
        raise InputError("friction_reading", friction_reading, allowed)
    points = np.asarray(points, dtype=np.int64)
    velocities = np.asarray(velocities, dtype=float)
    if velocities.ndim == 1:
        normal = velocities
        velocities = np.zeros((len(normal), 3))
        velocities[:, 2] = -normal
    _check_points(points, len(racket.bed_topology().points))
    mu = np.asarray(racket.friction_coefficients() if friction is None else friction, dtype=float)
    by_displacement = friction_reading == "displacement"
    scale = ball.sliding_distance_scale if by_displacement else ball.sliding_speed_scale
    balls = np.zeros((len(points), 9))
    for i, speed in enumerate(-velocities[:, 2]):
        balls[i, :2] = contact_constants(ball, speed)
    balls[:, 7:] = ball_law(ball)[6:]
    balls[:, 2], balls[:, 5], balls[:, 6] = mu[points - 1], scale.value, by_displacement
    index = np.zeros(len(points), dtype=np.int64) if bed is None else np.asarray(bed)
    nothing = np.zeros((len(points), 3, free))
    return Impacts(points, velocities, balls, ball.mass.value, nothing, index)


def contact_constants(ball: BallParameters, speed: float) -> tuple[float, float]:
    """Gives the ball's kb (N/m) and cb (N s/m) at a normal approach `speed` (m/s)."""
    low, high, kb, kb_growth, cb, cb_growth, _, _ = ball_law(ball)
    return (
        ball_constants(speed, low, high, kb, kb_growth),
        ball_constants(speed, low, high, cb, cb_growth),
    )
