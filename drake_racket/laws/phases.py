"""A contact has phases: when ball and strings touch and part, and what that leaves on record.

A record is a flat array of floats; PHASE, POINT and so on are the places of its numbers. The
functions change it in place. They run on floats, on AutoDiffXd (an array of objects, into which
they write floats too) and compiled. Drake's BallContact keeps a record as its discrete state.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.laws.compilation import compilable
from drake_racket.laws.contact import CONTACT, FREE, PASSED, ball_constants, stored_energy


@dataclass(frozen=True)
class ContactBodies:
    """Holds the indices of the plant's bodies, for the ports that list all bodies."""

    ball: int
    strings: tuple[int, ...]  # of the points in order


@dataclass(frozen=True)
class ContactModel:
    """Holds the numbers and choices of a contact, ready for the system below.

    Attributes:
        ball: speed_low, speed_high (m/s), kb at speed_low (N/m), its growth, cb at speed_low
            (N s/m), its growth; hb (N/m^2), db (N s/m^2): see `laws.contact`.
        friction: mu at the n points.
        scales: s_v (m/s), s_d (m).
        grid: (n, 2) x, y (m) of the points in the head, about the centre.
        rim: semi-axes along x, y (m); a ball outside passes by.
        point: its number, or 0 for the point nearest at touch.

    """

    ball: tuple[float, ...]
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
    HB,
    DB,
    AT_BALL,
    TOUCH,
    RELEASE,
    GIVEN_UP,
    TOUCHES,
) = range(17)
CONSTANTS = slice(KB, AT_BALL)  # the nine constants of contact_law, in its order
SIZE = 17
# on a discrete plant only: see the system's docstring
WEIGHT, RATE, LEAD, SEEN = 17, slice(18, 21), slice(21, 24), 24
ACTING, SPIN = slice(25, 34), slice(34, 37)
DISCRETE_SIZE = 37

NO_TIME = float("nan")
"""Of a touch or release that has not been."""


@dataclass(frozen=True)
class ContactRecord:
    """The record holds what a BallContact has latched, as numbers; see its discrete state.

    Attributes:
        phase: number of the contact's phase: before touch, in contact, or away.
        point: number of the string-bed point.
        approach_speed: m/s, normal to the strings, at first touch.
        kb: N/m, of the ball at that speed.
        cb: N s/m, likewise.
        hb, db: N/m^2, N s/m^2, what both grow by with compression.
        touch_time: s, of the first touch.
        release_time: s, of the last release.
        energy_given_up: J, of what compression was left at releases.
        touches: how often the ball touched.

    """

    phase: float
    point: int
    approach_speed: float
    kb: float
    cb: float
    hb: float
    db: float
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
        hb=s[HB],
        db=s[DB],
        touch_time=s[TOUCH],
        release_time=s[RELEASE],
        energy_given_up=s[GIVEN_UP],
        touches=round(s[TOUCHES]),
    )


@compilable
def nearest_point(grid: Any, x: Any, y: Any) -> int:
    """Gives the number (from 1) of the point that is nearest to a place in the head (m)."""
    nearest = 0
    for i in range(1, len(grid)):
        here = (grid[i, 0] - x) ** 2 + (grid[i, 1] - y) ** 2
        if here < (grid[nearest, 0] - x) ** 2 + (grid[nearest, 1] - y) ** 2:
            nearest = i
    return nearest + 1


@compilable
def inside_rim(grid: Any, rim: Any, point: int, p: Any) -> bool:
    """Tells whether the ball, at p (m) from a point's string mass, is over the strings."""
    x, y = grid[point - 1, 0] + p[0], grid[point - 1, 1] + p[1]
    return bool((x / rim[0]) ** 2 + (y / rim[1]) ** 2 < 1.0)


@compilable
def next_phase(phase: float, gap: Any, rate: Any, raw: Any, inside: bool) -> float:
    """Gives the phase that follows on `phase` at a state; it may be the same.

    Args:
        gap, rate: height (m) of the ball over the string mass and its rate (m/s).
        raw: kb x + cb x' (N), looked at in contact.  inside: of `inside_rim`.

    """
    if phase == CONTACT:
        if raw <= 0.0:
            return PASSED if gap < 0.0 else FREE
        return CONTACT
    if phase == PASSED:
        return FREE if gap >= 0.0 else PASSED
    if gap <= 0.0 and rate < 0.0 and inside:
        return CONTACT
    return PASSED if gap < 0.0 else FREE


@compilable
def latch(
    record: Any,
    point: int,
    p: Any,
    v: Any,
    time: Any,
    kb: Any,
    cb: Any,
    mu: Any,
    scale: Any,
    by_displacement: Any,
    at_ball: Any,
    hb: Any,
    db: Any,
) -> None:
    """Latches a touch, with the constants of `contact_law` given.

    Those of the normal force count at the first only.

    Args:
        point: number of the point that is hit.
        p, v: of the ball about the string mass, in the head (m, m/s).
        time: s.
        at_ball: the reaction acts at the ball (1) or at the string mass (0).

    """
    if record[TOUCHES] < 0.5:
        record[SPEED], record[KB], record[CB], record[TOUCH] = -v[2], kb, cb, time
        record[HB], record[DB] = hb, db
    record[PHASE], record[POINT], record[MU] = CONTACT, float(point), mu
    record[OFFSET_X], record[OFFSET_Y] = p[0], p[1]
    record[SCALE], record[BY_DISPLACEMENT], record[AT_BALL] = scale, by_displacement, at_ball
    record[TOUCHES] += 1.0


@compilable
def touch(
    record: Any,
    point: int,
    p: Any,
    v: Any,
    time: Any,
    ball: Any,
    friction: Any,
    scales: Any,
    choices: Any,
) -> None:
    """Records a touch: the first one latches approach speed, kb and cb; each one the others.

    Args:
        point, p, v, time: as of `latch`.
        ball, friction, scales, choices: the parameters of a BallContact.

    """
    kb = ball_constants(-v[2], ball[0], ball[1], ball[2], ball[3])
    cb = ball_constants(-v[2], ball[0], ball[1], ball[4], ball[5])
    by_displacement = 1.0 if choices[1] > 0.5 else 0.0
    scale = scales[1] if choices[1] > 0.5 else scales[0]
    mu = friction[point - 1]
    hb, db = ball[6], ball[7]
    latch(record, point, p, v, time, kb, cb, mu, scale, by_displacement, choices[2], hb, db)


@compilable
def late_touch(record: Any, p: Any, v: Any, step: float) -> None:
    """Tells what a discrete step (s) makes up for; a run that starts in contact is not late."""
    lag = p[2] / v[2]
    if lag > step:
        lag = 0.0 * lag
    record[WEIGHT] = 0.5 + lag / step
    for i in range(3):
        record[RATE.start + i], record[LEAD.start + i] = v[i], 0.0 * v[i]


@compilable
def release(record: Any, p: Any, time: Any) -> None:
    """The end of the force: the energy of what compression is left is given up."""
    record[PHASE] = PASSED if p[2] < 0.0 else FREE
    record[RELEASE] = time
    record[GIVEN_UP] += stored_energy(-p[2], record[KB], record[HB])


def late_release(record: Any, p: Any, v: Any, step: float) -> None:
    """Gives up what was stored half a discrete step (s) ago: up to then the last force acted."""
    stored = p[2] - 0.5 * step * v[2]
    squares, cubes = stored * stored - p[2] * p[2], p[2] ** 3 - stored**3
    record[GIVEN_UP] += 0.5 * record[KB] * squares + record[HB] * cubes / 3.0


def value_of(x: Any) -> float:
    """Gives the value of a float or an AutoDiffXd."""
    return float(x) if isinstance(x, (float, int)) else float(x.value())
