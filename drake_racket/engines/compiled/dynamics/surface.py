"""Lets a ball with radius and spin meet the strings of a model anywhere; law: `laws.surface`.

The element u of each such contact stands in the state y behind positions and velocities. Events are
as in `events`, and two more: the turns between gripping and sliding.
"""

from __future__ import annotations

from typing import Any

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.engines.compiled.dynamics.forces import add_force, relative
from drake_racket.engines.compiled.dynamics.layout import VEL
from drake_racket.engines.compiled.dynamics.motion import back, cross, turn
from drake_racket.laws.compilation import compilable
from drake_racket.laws.contact import CONTACT, FREE, PASSED
from drake_racket.laws.phases import PHASE, POINT, next_phase
from drake_racket.laws.places import met_weights
from drake_racket.laws.surface import (
    NEARLY,
    POINT_0,
    WEIGHT_0,
    round_place,
    surface_law,
    surface_losses,
    surface_release,
    surface_switch,
    surface_touch,
)
from drake_racket.laws.totals import IMPULSE, LOST_BALL, LOST_FRICTION

IMPULSE_AT = IMPULSE.start
RELEASED = 1e-3
"""N: a normal force below this where gripping ends is that of the release."""

FAR = 0.005
"""m over all string masses: the place in the bed is not looked at, a ball needs a step to come."""


@compilable
def is_surface(model: Any, i: int) -> bool:
    """Tells whether contact i is one of this law."""
    return bool(model[at.CONTACT_ROWS][i, at.ELEMENT] >= 0)


@compilable
def ball_in_head(c: Any, n: Any, rows: Any, places: Any, y: Any, w: Any, leaves: Any) -> Any:
    """Gives p, v and omega of `laws.surface` for a contact, and the rotation of the head's axes.

    Args:
        c, n: its rows of CONTACT_ROWS and CONTACT_NUMBERS.  rows, places: the tables LEAF_ROWS and
            POINT_NUMBERS; by themselves, since a call with the whole model costs as much as 30
            multiplications.

    """
    first, ball = c[at.LEAF_0], c[at.BALL]
    head, leaf = rows[first, 0], leaves[first]
    p, v, r = relative(n, ball, head, w, leaf)
    z, place = y[rows[first, at.LEAF_Q]], places[c[at.GRID_0]]
    a = w[ball]
    w0, w1, w2 = a[VEL], a[VEL + 1], a[VEL + 2]
    if head >= 0:
        b = w[head]
        w0, w1, w2 = w0 - b[VEL], w1 - b[VEL + 1], w2 - b[VEL + 2]
    p = p[0] + place[0], p[1] + place[1], p[2] + z
    v = v[0], v[1], v[2] + leaf[at.RATE]
    return p, v, back(r, (w0, w1, w2)), r


@compilable
def law_of(c: Any, rows: Any, y: Any, record: Any, p: Any, v: Any, spin: Any, leaves: Any) -> Any:
    """Gives what `surface_law` does for a contact; arguments of `ball_in_head`."""
    z, rate = 0.0, 0.0
    for k in range(4):
        leaf = c[at.LEAF_0] + round_place(record[POINT_0 + k])
        z += record[WEIGHT_0 + k] * y[rows[leaf, at.LEAF_Q]]
        rate += record[WEIGHT_0 + k] * leaves[leaf, at.RATE]
    u = c[at.ELEMENT]
    return surface_law(p, v, spin, z, rate, y[u], y[u + 1], record)


@compilable
def apart(c: Any, n: Any, rows: Any, places: Any, y: Any, p: Any, v: Any, leaves: Any) -> Any:
    """Gives gap (m), rate of compression (m/s) and nearest point (from 1) of a ball apart."""
    grid = places[c[at.GRID_0] : c[at.GRID_0] + c[at.POINTS]]
    points, weights, shares = met_weights(
        grid, n[at.RIM : at.RIM + 2], p[0], p[1], n[at.SURFACE + 4]
    )
    gap, rate, nearest = p[2] - n[at.SURFACE], -v[2], 0
    for k in range(4):
        leaf = c[at.LEAF_0] + points[k]
        gap -= weights[k] * y[rows[leaf, at.LEAF_Q]]
        rate += weights[k] * leaves[leaf, at.RATE]
        if shares[k] > shares[nearest]:
            nearest = k
    return gap, rate, points[nearest] + 1


@compilable
def _highest(c: Any, rows: Any, y: Any) -> Any:
    """Height (m) of the bed's highest string mass, or of the rim."""
    highest = 0.0
    for k in range(c[at.POINTS]):
        z = y[rows[c[at.LEAF_0] + k, at.LEAF_Q]]
        if z > highest:
            highest = z
    return highest


@compilable
def surface_contact(
    model: Any, i: int, y: Any, record: Any, w: Any, leaves: Any, f: Any, audit: bool
) -> None:
    """Lets ball, string masses and head act on each other, and writes u' and the losses into f."""
    c, n = model[at.CONTACT_ROWS][i], model[at.CONTACT_NUMBERS][i]
    rows, places = model[at.LEAF_ROWS], model[at.POINT_NUMBERS]
    p, v, spin, r = ball_in_head(c, n, rows, places, y, w, leaves)
    found = law_of(c, rows, y, record, p, v, spin, leaves)
    f0, f1, f2 = turn(r, (found[0], found[1], found[2]))
    k = c[at.ELEMENT]
    f[k], f[k + 1] = found[3], found[4]
    # from the first string mass to the contact point, about the fixed point
    first = c[at.LEAF_0]
    leaf, place = leaves[first], places[c[at.GRID_0]]
    z = y[rows[first, at.LEAF_Q]]
    d = turn(r, (p[0] - place[0], p[1] - place[1], p[2] - z - found[7]))
    x0, x1, x2 = leaf[0] + d[0], leaf[1] + d[1], leaf[2] + d[2]
    m0, m1, m2 = cross(x0, x1, x2, f0, f1, f2)
    add_force(w, c[at.BALL], m0, m1, m2, f0, f1, f2)
    # at C each mass takes its share, and the rim the rest; its arm to C is about the masses' mean
    rim, s0, s1, s2 = 1.0, 0.0, 0.0, 0.0
    for k in range(4):
        weight = record[WEIGHT_0 + k]
        own = leaves[first + round_place(record[POINT_0 + k])]
        rim -= weight
        s0, s1, s2 = s0 + weight * own[0], s1 + weight * own[1], s2 + weight * own[2]
        own[at.PUSH] -= weight * f0
        own[at.PUSH + 1] -= weight * f1
        own[at.PUSH + 2] -= weight * f2
    m0, m1, m2 = cross(x0 - s0, x1 - s1, x2 - s2, f0, f1, f2)
    add_force(w, rows[first, 0], -m0, -m1, -m2, -rim * f0, -rim * f1, -rim * f2)
    if audit:
        total = model[at.HEAD][at.POSITIONS] + model[at.HEAD][at.VELOCITIES]
        total += model[at.HEAD][at.ELEMENTS]
        f[total + LOST_BALL], f[total + LOST_FRICTION] = surface_losses(found, record)
        f[total + IMPULSE_AT], f[total + IMPULSE_AT + 1], f[total + IMPULSE_AT + 2] = f0, f1, f2


@compilable
def surface_watched(model: Any, i: int, y: Any, record: Any, w: Any, leaves: Any) -> Any:
    """What is zero at the next event: as `events.watched`, and where gripping or sliding ends."""
    c, n = model[at.CONTACT_ROWS][i], model[at.CONTACT_NUMBERS][i]
    rows, places = model[at.LEAF_ROWS], model[at.POINT_NUMBERS]
    if record[PHASE] == CONTACT:
        p, v, spin, _ = ball_in_head(c, n, rows, places, y, w, leaves)
        found = law_of(c, rows, y, record, p, v, spin, leaves)
        return found[2], 0.0, found[10]
    p, v, _, _ = ball_in_head(c, n, rows, places, y, w, leaves)
    height = p[2] - n[at.SURFACE]
    free = height - _highest(c, rows, y)
    if free > FAR:  # at least so far apart, whichever masses are under the ball
        return free, v[2], 1.0
    gap, rate, _ = apart(c, n, rows, places, y, p, v, leaves)
    return gap, -rate, 1.0


@compilable
def _touch(
    c: Any,
    n: Any,
    places: Any,
    y: Any,
    p: Any,
    v: Any,
    spin: Any,
    rate: Any,
    time: float,
    record: Any,
) -> None:
    """Records a touch of a contact, with its parameters, and lays the element at rest."""
    rows = places[c[at.GRID_0] : c[at.GRID_0] + c[at.POINTS]]
    ball, surface = n[at.BALL_LAW : at.BALL_LAW + 8], n[at.SURFACE : at.SURFACE + 5]
    rim = n[at.RIM : at.RIM + 2]
    surface_touch(record, p, v, spin, rate, time, ball, rows[:, 2], surface, rows, rim)
    y[c[at.ELEMENT]], y[c[at.ELEMENT] + 1] = 0.0, 0.0


@compilable
def _within_rim(n: Any, p: Any) -> bool:
    return bool((p[0] / n[at.RIM]) ** 2 + (p[1] / n[at.RIM + 1]) ** 2 < 1.0)


@compilable
def surface_update(
    model: Any, i: int, time: float, y: Any, record: Any, w: Any, leaves: Any
) -> bool:
    """Takes contact i to what the present state asks for; tells whether it changed."""
    c, n = model[at.CONTACT_ROWS][i], model[at.CONTACT_NUMBERS][i]
    rows, places = model[at.LEAF_ROWS], model[at.POINT_NUMBERS]
    phase = record[PHASE]
    p, v, spin, _ = ball_in_head(c, n, rows, places, y, w, leaves)
    if phase == CONTACT:
        found = law_of(c, rows, y, record, p, v, spin, leaves)
        if found[2] <= 0.0:
            u = c[at.ELEMENT]
            surface_release(record, found[8], y[u], y[u + 1], time)
            return True
        if found[10] < -NEARLY * found[2]:
            surface_switch(record, time)
            return True
        return False
    gap, rate, _ = apart(c, n, rows, places, y, p, v, leaves)
    inside = phase == FREE and _within_rim(n, p)
    coming = next_phase(phase, gap, -rate, 0.0, inside)
    record[PHASE] = coming
    if coming == CONTACT and phase != CONTACT:
        _touch(c, n, places, y, p, v, spin, rate, time, record)
    return bool(coming != phase)


@compilable
def surface_event(
    model: Any, i: int, turning: bool, time: float, y: Any, record: Any, w: Any, leaves: Any
) -> None:
    """Takes contact i through the event that was located, whatever the last digit says.

    Args:
        turning: the end of gripping or sliding, not a change of the phase.

    """
    c, n = model[at.CONTACT_ROWS][i], model[at.CONTACT_NUMBERS][i]
    rows, places = model[at.LEAF_ROWS], model[at.POINT_NUMBERS]
    p, v, spin, _ = ball_in_head(c, n, rows, places, y, w, leaves)
    if record[PHASE] == CONTACT:
        found = law_of(c, rows, y, record, p, v, spin, leaves)
        if turning and found[2] > RELEASED:
            surface_switch(record, time)
            return
        u = c[at.ELEMENT]
        surface_release(record, found[8], y[u], y[u + 1], time)
        return
    _, rate, _ = apart(c, n, rows, places, y, p, v, leaves)
    if record[PHASE] == PASSED:
        record[PHASE] = FREE
    elif rate > 0.0 and _within_rim(n, p):
        _touch(c, n, places, y, p, v, spin, rate, time, record)
    else:
        record[PHASE] = PASSED


@compilable
def see_surface(model: Any, y: Any, record: Any, w: Any, leaves: Any, row: Any) -> None:
    """Writes what the SurfaceContact's output `contact_state` has, for the first contact."""
    c, n = model[at.CONTACT_ROWS][0], model[at.CONTACT_NUMBERS][0]
    rows, places = model[at.LEAF_ROWS], model[at.POINT_NUMBERS]
    p, v, spin, _ = ball_in_head(c, n, rows, places, y, w, leaves)
    if record[PHASE] == CONTACT:
        found = law_of(c, rows, y, record, p, v, spin, leaves)
        row[1], row[2], row[3] = record[POINT], found[8], found[9]
        row[4], row[5], row[6] = max(found[2], 0.0), found[0], found[1]
        row[7], row[8] = found[5] - found[3], found[6] - found[4]
        return
    gap, rate, nearest = apart(c, n, rows, places, y, p, v, leaves)
    row[1], row[2], row[3] = nearest, -gap, rate
    row[7], row[8] = v[0], v[1]
