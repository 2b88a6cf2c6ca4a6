"""Runs batches of impacts of balls with radius and spin on a bed whose head is clamped.

`surface` has the equations; the law is the one of Drake's SurfaceContact, and a test ties a batch
to the other engines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.engines.clamped.batch import STEP, Bed
from drake_racket.engines.clamped.surface import run_surface_batch
from drake_racket.io.errors import InputError
from drake_racket.laws.surface import SurfaceModel
from drake_racket.parameters.ball import BallParameters, surface_of
from drake_racket.parameters.racket import RacketParameters
from drake_racket.plant.contacts import surface_model

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SpinningImpacts:
    """The impacts of a batch are m shots at one bed.

    Attributes:
        places: (m, 2) x, y of the first touch from the bed's centre (m).
        velocities, spins: (m, 3) of the ball in the head at touch (m/s, rad/s); z negative.
        surfaces: (m, 5) as of `SurfaceModel`.
        friction: (m, n) mu at the points.
        moment: kg m^2, of inertia of the ball.

    """

    places: Array
    velocities: Array
    spins: Array
    surfaces: Array
    friction: Array
    moment: float


@dataclass(frozen=True)
class SpinningRebounds:
    """What a batch gives.

    Attributes:
        velocities, spins: (m, 3) of the ball at its last release (m/s, rad/s).
        contact_time: (m,) from first touch to last release (s).
        sliding_time: (m,) of it spent sliding (s).
        touches: (m,) how often ball and strings met.
        ended: (m,) False where the ball never came out of reach: its numbers are no result.

    """

    velocities: Array
    spins: Array
    contact_time: Array
    sliding_time: Array
    touches: NDArray[np.int64]
    ended: NDArray[np.bool_]


def spinning_impacts(
    racket: RacketParameters,
    ball: BallParameters,
    places: Any,
    velocities: Any,
    spins: Any = None,
    *,
    friction: Any = None,
) -> SpinningImpacts:
    """Makes impacts of a ball on a racket's bed, with the numbers of their files.

    Args:
        places, velocities, spins: as of `SpinningImpacts`; no spin if None.
        friction: one mu in place of the racket's.

    Raises:
        InputError: the ball has no numbers of its surface.

    """
    places, velocities = (
        np.atleast_2d(places).astype(float),
        np.atleast_2d(velocities).astype(float),
    )
    m = len(places)
    model = surface_model(racket, ball)
    mu = np.array(model.friction) if friction is None else np.full(len(model.grid), friction)
    factor = surface_of(ball).inertia_factor.value
    return SpinningImpacts(
        places,
        velocities,
        np.zeros((m, 3)) if spins is None else np.atleast_2d(spins).astype(float),
        np.tile(np.array(model.surface), (m, 1)),
        np.tile(mu, (m, 1)),
        factor * ball.mass.value * ball.radius.value**2,
    )


def run_spinning(
    bed: Bed, model: SurfaceModel, ball_mass: float, impacts: SpinningImpacts, *, step: float = STEP
) -> SpinningRebounds:
    """Simulates a batch, compiled and on all cores where numba is installed.

    Args:
        bed: of `make_bed`.  model: kb, cb, grid and rim (`plant.compose.surface_model`).
        ball_mass: kg.
        step: s, of the Runge-Kutta steps.

    Raises:
        InputError: shapes or numbers that do not fit.

    """
    _check(bed, model, impacts, step)
    out = np.zeros((len(impacts.places), 10))
    run_surface_batch(
        impacts.places,
        impacts.velocities,
        impacts.spins,
        impacts.surfaces,
        impacts.friction,
        impacts.moment,
        np.array(model.ball),
        np.ascontiguousarray(model.grid),
        np.array(model.rim),
        bed.topology.ends,
        bed.constants,
        np.array([ball_mass, bed.mass]),
        bed.static_stiffness(),
        step,
        out,
    )
    return SpinningRebounds(
        out[:, :3], out[:, 3:6], out[:, 6], out[:, 7], out[:, 8].astype(np.int64), out[:, 9] > 0.5
    )


def _check(bed: Bed, model: SurfaceModel, impacts: SpinningImpacts, step: float) -> None:
    m, n = len(impacts.places), len(bed.topology.points)
    shapes: Sequence[tuple[str, Array, tuple[int, ...]]] = (
        ("places", impacts.places, (m, 2)),
        ("velocities", impacts.velocities, (m, 3)),
        ("spins", impacts.spins, (m, 3)),
        ("surfaces", impacts.surfaces, (m, 5)),
        ("friction", impacts.friction, (m, n)),
        ("model.grid", model.grid, (n, 2)),
    )
    for key, array, shape in shapes:
        if array.shape != shape:
            raise InputError(key, f"an array of shape {array.shape}", f"shape {shape}")
        if not np.isfinite(array).all():
            raise InputError(key, "a number that is not finite", "finite numbers")
    if not (impacts.velocities[:, 2] < 0.0).all():
        raise InputError("velocities", "z of 0 or more", "a ball that comes towards -z")
    inside = np.sum((impacts.places / model.rim) ** 2, axis=1) < 1.0
    if not inside.all():
        first = impacts.places[np.argmin(inside)]
        raise InputError("places", first.tolist(), "places within the rim")
    if not 1e-7 <= step <= 1e-4:
        raise InputError("step", step, "1e-7 to 1e-4 s")
