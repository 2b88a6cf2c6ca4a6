"""Knows the events of a contact: what to watch, and how they change its record.

The phases are those of `laws.phases`, on records like a BallContact's.
"""

from __future__ import annotations

from typing import Any

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.engines.compiled.dynamics.forces import relative
from drake_racket.engines.compiled.dynamics.surface import (
    is_surface,
    surface_event,
    surface_update,
    surface_watched,
)
from drake_racket.laws.compilation import compilable
from drake_racket.laws.contact import CONTACT, FREE, PASSED, contact_law
from drake_racket.laws.phases import (
    CONSTANTS,
    PHASE,
    POINT,
    nearest_point,
    next_phase,
    release,
    touch,
)


@compilable
def look(model: Any, i: int, records: Any, w: Any, leaves: Any, choose: bool) -> Any:
    """Looks at contact i: point in contact or to be hit, p and v of the ball about its mass."""
    c, n = model[at.CONTACT_ROWS][i], model[at.CONTACT_NUMBERS][i]
    first, count, ball = c[at.LEAF_0], c[at.POINTS], c[at.BALL]
    head = model[at.LEAF_ROWS][first, 0]
    point = int(records[i, POINT])
    if choose:
        point = int(n[at.CHOICES])
        if point == 0:
            middle = c[at.MIDDLE]
            grid = model[at.POINT_NUMBERS][c[at.GRID_0] : c[at.GRID_0] + count]
            p, _, _ = relative(n, ball, head, w, leaves[first + middle - 1])
            point = nearest_point(grid, grid[middle - 1, 0] + p[0], grid[middle - 1, 1] + p[1])
    p, v, _ = relative(n, ball, head, w, leaves[first + point - 1])
    return point, p, v


@compilable
def _within_rim(model: Any, i: int, point: int, p: Any) -> bool:
    c, n = model[at.CONTACT_ROWS][i], model[at.CONTACT_NUMBERS][i]
    row = c[at.GRID_0] + point - 1
    x, y = model[at.POINT_NUMBERS][row, 0] + p[0], model[at.POINT_NUMBERS][row, 1] + p[1]
    return bool((x / n[at.RIM]) ** 2 + (y / n[at.RIM + 1]) ** 2 < 1.0)


@compilable
def _touch(model: Any, i: int, point: int, p: Any, v: Any, time: float, record: Any) -> None:
    """Records a touch of contact i, with its parameters."""
    c, n = model[at.CONTACT_ROWS][i], model[at.CONTACT_NUMBERS][i]
    friction = model[at.POINT_NUMBERS][c[at.GRID_0] : c[at.GRID_0] + c[at.POINTS], 2]
    ball = n[at.BALL_LAW : at.BALL_LAW + 8]
    scales, choices = n[at.SCALES : at.SCALES + 2], n[at.CHOICES : at.CHOICES + 3]
    touch(record, point, p, v, time, ball, friction, scales, choices)


@compilable
def watched(model: Any, i: int, y: Any, records: Any, w: Any, leaves: Any) -> Any:
    """What is zero at the next event of contact i: raw normal force in contact, else the gap.

    Returns:
        that number; its rate where it is a gap; and what is zero where contact surface turns from
        gripping to sliding or back (1 where nothing can).

    """
    if model[at.CONTACT_ROWS][i, at.ELEMENT] >= 0:
        return surface_watched(model, i, y, records[i], w, leaves)
    if records[i, PHASE] == CONTACT:
        _, p, v = look(model, i, records, w, leaves, False)
        return contact_law(p, v, records[i, CONSTANTS])[3], 0.0, 1.0
    _, p, v = look(model, i, records, w, leaves, True)
    return p[2], v[2], 1.0


@compilable
def update(model: Any, i: int, time: float, y: Any, records: Any, w: Any, leaves: Any) -> bool:
    """Takes contact i to the phase that the present state asks for; tells whether it changed."""
    if is_surface(model, i):
        return bool(surface_update(model, i, time, y, records[i], w, leaves))
    record = records[i]
    phase = record[PHASE]
    if phase == CONTACT:
        _, p, v = look(model, i, records, w, leaves, False)
        raw = contact_law(p, v, record[CONSTANTS])[3]
        coming = next_phase(phase, p[2], v[2], raw, True)
        if coming != CONTACT:
            release(record, p, time)
        return bool(coming != phase)
    point, p, v = look(model, i, records, w, leaves, True)
    inside = phase == FREE and _within_rim(model, i, point, p)
    coming = next_phase(phase, p[2], v[2], 0.0, inside)
    if coming == CONTACT:
        _touch(model, i, point, p, v, time, record)
    else:
        record[PHASE] = coming
    return bool(coming != phase)


@compilable
def pass_event(
    model: Any, event: int, time: float, y: Any, records: Any, w: Any, leaves: Any
) -> None:
    """Takes a contact through the event that was located, whatever the last digit says.

    Args:
        event: number of the contact; from the number of contacts on, the turns between gripping
            and sliding of contact surface, likewise.

    """
    i, turning = event % len(records), event >= len(records)
    if is_surface(model, i):
        surface_event(model, i, turning, time, y, records[i], w, leaves)
        return
    record = records[i]
    point, p, v = look(model, i, records, w, leaves, record[PHASE] != CONTACT)
    if record[PHASE] == CONTACT:
        release(record, p, time)
    elif record[PHASE] == PASSED:
        record[PHASE] = FREE
    elif v[2] < 0.0 and _within_rim(model, i, point, p):
        _touch(model, i, point, p, v, time, record)
    else:
        record[PHASE] = PASSED


@compilable
def dips(gaps: Any, slopes: Any, i: int, h: float) -> bool:
    """Tells whether a gap that is open at both ends of a step may have closed between them."""
    before, after, slope, slope_after = gaps[0, i], gaps[1, i], slopes[0, i], slopes[1, i]
    if before <= 0.0 or after <= 0.0 or slope >= 0.0 or slope_after <= 0.0:
        return False
    # where the two tangents meet is below the curve, which bends upwards
    time = (after - before - slope_after * h) / (slope - slope_after)
    return bool(before + slope * time < 0.0)
