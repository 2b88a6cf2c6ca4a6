"""Tells what an impact did to the ball's spin, and what it did to the racket as a moment.

With v_s = v_t + omega x (-R e_z) the velocity of the ball's surface over the strings, relative to
the racket's initial motion where the ball is aimed, and d its direction before the impact:

    tangential restitution   -(v_s after . d) / |v_s before|

which is 1 where a perfectly elastic grip gives all of it back, 0 where the ball leaves rolling, and
negative where it still slides. Overspin: the surface goes backwards over the strings, v_c . d < 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_racket.cases.case import Case
from drake_racket.engines.trajectory import Trajectory, cross
from drake_racket.laws.contact import CONTACT
from drake_racket.laws.phases import OFFSET_X, OFFSET_Y, PHASE
from drake_racket.laws.surface import CT, GRIPS, KT, SINCE, SLID
from drake_racket.plant.systems.ports import ContactState

Array = NDArray[np.float64]

_STILL = 1e-6
"""m/s, below which the ball's surface has no direction over the strings."""


@dataclass(frozen=True)
class Sliding:
    """Says how a ball of contact surface went over the strings.

    Attributes:
        fraction: of the contact, spent sliding.
        grip_time, overspin_time: s.
        place: (2,) x, y of the first touch in the head, from the bed's centre (m).

    """

    fraction: float
    grip_time: float
    overspin_time: float
    place: Array


def ball_spins(trajectory: Trajectory) -> Array:
    """Gives the angular velocity (n, 3) of the ball in the world, at every sample (rad/s)."""
    start = trajectory.mechanism.ball_velocity - 3
    return trajectory.state[:, start : start + 3]


def sliding(trajectory: Trajectory) -> Sliding | None:
    """Tells how the ball went over the strings; None without a touch or with contact paper."""
    record, time, element = trajectory.record, trajectory.time, trajectory.element
    touching = record[:-1, PHASE] == CONTACT
    if not element.size or not touching.any():
        return None
    steps = np.diff(time)
    whole = float(np.sum(steps[touching]))
    slid = float(record[-1, SLID])
    if record[-1, PHASE] == CONTACT and record[-1, GRIPS] < 0.5:  # the run ended in contact
        slid += float(time[-1] - record[-1, SINCE])
    first = int(np.argmax(touching))
    velocity = _surface_velocity(trajectory)
    overspin = 0.0
    if np.linalg.norm(velocity[first]) > _STILL:
        along = velocity @ (velocity[first] / np.linalg.norm(velocity[first]))
        overspin = float(np.sum(_negative_share(along) * steps * touching))
    return Sliding(slid / whole, whole - slid, overspin, record[first, [OFFSET_X, OFFSET_Y]])


def _surface_velocity(trajectory: Trajectory) -> Array:
    """V_c (n, 2) in contact: what slides, and the element's rate (-F - kt u) / ct."""
    contact, record = trajectory.contact, trajectory.record
    force = contact[:, [ContactState.FRICTION_X, ContactState.FRICTION_Y]]
    slip = contact[:, [ContactState.SLIDING_X, ContactState.SLIDING_Y]]
    inside = record[:, PHASE] == CONTACT
    ct = np.where(inside, record[:, CT], 1.0)[:, None]
    rate = (-force - record[:, KT, None] * trajectory.element) / ct
    return np.where(inside[:, None], slip + rate, 0.0)


def _negative_share(values: Array) -> Array:
    """The share of each step in which a number that goes straight from end to end is negative."""
    a, b = values[:-1], values[1:]
    span = np.where(a == b, 1.0, np.abs(b - a))
    below = np.clip(-np.minimum(a, b), 0.0, None)
    found: Array = np.where(a == b, (a < 0.0).astype(float), np.clip(below / span, 0.0, 1.0))
    return found


def tangential_restitution(
    case: Case, velocities: tuple[Array, Array], spins: tuple[Array, Array], aim: Array
) -> float | None:
    """Gives the tangential restitution; None with contact paper, or without a direction.

    Args:
        velocities, spins: of the ball before and after, in R.  aim: velocity of the racket there.

    """
    if case.scenario.contact == "paper":
        return None
    radius = case.ball.radius.value
    before, after = (
        (v - aim + cross(w, np.array([0.0, 0.0, -radius])))[:2]
        for v, w in zip(velocities, spins, strict=True)
    )
    size = float(np.linalg.norm(before))
    return None if size < _STILL else -float(after @ before) / size**2


def angular_impulse(
    case: Case, trajectory: Trajectory, first: int, last: int, R_WR: Array
) -> Array:
    """Gives the contact's angular impulse on the racket (N m s), in R and about its origin.

    It is what the ball has lost between two samples, its spin included; gravity's share is in it.
    """
    mechanism = trajectory.mechanism
    origin = trajectory.motion.poses[0, mechanism.handle, :, 3]
    place, velocity = mechanism.ball_position, mechanism.ball_velocity
    moment = mechanism.bodies.moments[mechanism.ball, 0, 0]
    momenta = []
    for sample in (first, last):
        arm = trajectory.state[sample, place : place + 3] - origin
        v = trajectory.state[sample, velocity : velocity + 3]
        spin = moment * ball_spins(trajectory)[sample]
        momenta.append(case.ball.mass.value * cross(arm, v) + spin)
    found: Array = (momenta[0] - momenta[1]) @ R_WR
    return found


def impulse_place(impulse: Array, angular: Array) -> Array | None:
    """Gives x, y in R where an impulse on the strings' plane has that angular impulse (m).

    None without a normal impulse.

    Args:
        impulse, angular: on the racket (N s, N m s).

    """
    if abs(impulse[2]) < 1e-9:
        return None
    return np.array([-angular[1] / impulse[2], angular[0] / impulse[2]])
