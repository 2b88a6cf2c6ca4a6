"""What a BallContact is made of and what it latches: numbers, state, touch and release, record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.laws.contact import CONTACT, FREE, PASSED, ball_constants


@dataclass(frozen=True)
class ContactBodies:
    """Indices of the plant's bodies, for the ports that list all bodies."""

    ball: int
    strings: tuple[int, ...]  # nine, points 1-9


@dataclass(frozen=True)
class ContactModel:
    """The numbers and choices of a contact, ready for the system below.

    Attributes:
        ball: speed_low, speed_high (m/s), kb at speed_low (N/m), its growth, cb at speed_low
            (N s/m), its growth.
        friction: mu at points 1-9.
        scales: s_v (m/s), s_d (m).
        grid: (9, 2) x, y (m) of the points in the head, about the centre.
        rim: semi-axes along x, y (m); a ball outside passes by.
        point: 1-9, or 0 for the point nearest at touch.

    """

    ball: tuple[float, float, float, float, float, float]
    friction: tuple[float, ...]
    scales: tuple[float, float]
    grid: NDArray[np.float64]
    rim: tuple[float, float]
    point: int
    by_displacement: bool
    reaction_at_ball: bool


(
    PHASE,
    POINT,
    SPEED,
    KB,
    CB,
    MU,
    OFFSET_X,
    OFFSET_Y,
    SCALE,
    BY_DISPLACEMENT,
    AT_BALL,
    TOUCH,
    RELEASE,
    GIVEN_UP,
    TOUCHES,
) = range(15)
CONSTANTS = slice(KB, AT_BALL)  # the seven constants of contact_law, in its order
SIZE = 15
# on a discrete plant only: see the system's docstring
WEIGHT, RATE, LEAD, SEEN, POWER = 15, slice(16, 19), slice(19, 22), 22, slice(23, 29)
DISCRETE_SIZE = 29


@dataclass(frozen=True)
class ContactRecord:
    """What a BallContact has latched, as plain numbers; see its discrete state."""

    phase: float
    point: int
    approach_speed: float
    kb: float
    cb: float
    touch_time: float
    release_time: float
    energy_given_up: float
    touches: int


def contact_record(state: Any) -> ContactRecord:
    """Reads the record from a BallContact's discrete state, a discrete plant's as well."""
    s = [value_of(x) for x in state]
    return ContactRecord(
        phase=s[PHASE],
        point=round(s[POINT]),
        approach_speed=s[SPEED],
        kb=s[KB],
        cb=s[CB],
        touch_time=s[TOUCH],
        release_time=s[RELEASE],
        energy_given_up=s[GIVEN_UP],
        touches=round(s[TOUCHES]),
    )


def touch_changes(
    state: Any, point: int, p: Any, v: Any, time: Any, parameters: Sequence[Any]
) -> dict[int, Any]:
    """What a touch latches: the first one approach speed, kb, cb; each one the other constants.

    Args:
        state: before it.
        point: 1-9, that is hit.
        p, v: of the ball about the string mass, in the head (m, m/s).
        time: s.
        parameters: the BallContact's: ball, friction, scales, choices.

    """
    ball, friction, scales, choices = parameters
    by_displacement = round(value_of(choices[1]))
    touches = round(value_of(state[TOUCHES]))
    changes = {
        PHASE: CONTACT,
        POINT: point,
        MU: friction[point - 1],
        OFFSET_X: p[0],
        OFFSET_Y: p[1],
        SCALE: scales[by_displacement],
        BY_DISPLACEMENT: by_displacement,
        AT_BALL: choices[2],
        TOUCHES: touches + 1,
    }
    if touches == 0:
        low, high, kb, kb_growth, cb, cb_growth = ball
        changes |= {
            SPEED: -v[2],
            KB: ball_constants(-v[2], low, high, kb, kb_growth),
            CB: ball_constants(-v[2], low, high, cb, cb_growth),
            TOUCH: time,
        }
    return changes


def late_touch_changes(p: Any, v: Any, step: float) -> dict[int, Any]:
    """What a discrete step (s) makes up for; a run that starts in contact is not late."""
    lag = p[2] / v[2]
    if value_of(lag) > step:
        lag = 0.0 * lag
    return {WEIGHT: 0.5 + lag / step} | spread(RATE, v) | spread(LEAD, 0.0 * np.array(v))


def release_changes(state: Any, p: Any, time: Any) -> dict[int, Any]:
    """What the end of the force leaves: the energy of what compression is left is given up."""
    return {
        PHASE: PASSED if value_of(p[2]) < 0.0 else FREE,
        RELEASE: time,
        GIVEN_UP: state[GIVEN_UP] + 0.5 * state[KB] * p[2] * p[2],
    }


def spread(indices: slice, values: Any) -> dict[int, Any]:
    """Index -> value, for a part of the state."""
    return dict(zip(range(indices.start, indices.stop), values, strict=True))


def value_of(x: Any) -> float:
    """The value of a float or an AutoDiffXd."""
    return float(x) if isinstance(x, (float, int)) else float(x.value())
