"""One normal or oblique impact on a string-bed whose head is clamped, as compiled loops.

`clamped_ode` has the equations, made of the laws of the Drake systems. Touch is at t = 0. A step is
Runge-Kutta of order 4; release, a second touch and the peaks are placed inside a step by root
finding. The run ends when the ball is out of reach: the energy E left in the bed cannot lift the
struck mass above sqrt(2 E / K), K its static stiffness without the springs' k, which only adds.

Sensitivities s = dy/dtheta go through the same Runge-Kutta steps: they are the exact derivatives of
the computed states at a fixed time. Where the force jumps (a second touch at t_e) s jumps by
(f_before - f_after) dt_e/dtheta. At release the force is 0 on both sides.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drake_racket.engines.clamped import ode as clamped_ode
from drake_racket.engines.clamped.ode import force_by_theta, rates, relative, tangent_rates
from drake_racket.laws import contact, strings
from drake_racket.laws.compilation import compilable, compiled, parallel_range, sources_stamp
from drake_racket.laws.contact import contact_law
from drake_racket.laws.strings import FIRST, SECOND, spring_energy

OUTPUTS = ("v_x", "v_y", "v_z", "contact_time", "peak_normal_force", "peak_deflection")
"""Rebound velocity (m/s, in the head), first touch to last release (s), N, m (struck mass)."""

TOUCHES, ENDED = 6, 7
"""Columns after OUTPUTS: number of touches; 1 if the ball was out of reach within LONGEST."""

LONGEST = 0.03
"""s; contacts take 3 to 6 ms."""

RELEASE, GAP, TURN, CREST = range(4)


@compilable
def _step(
    y: Any, h: float, touching: bool, p: int, bed: Any, ball: Any, mass: Any, w: Any, new: Any
) -> None:
    """One Runge-Kutta step of y into `new`.

    w (15, 24): rows 0-3 the slopes, of which the first is given; 4-7 the stages; 8-14 scratch.
    """
    w[4] = y
    for stage in range(1, 4):
        part = h if stage == 3 else 0.5 * h
        for i in range(24):
            w[4 + stage, i] = y[i] + part * w[stage - 1, i]
        rates(w[4 + stage], touching, p, bed, ball, mass, w[8:], w[stage])
    for i in range(24):
        new[i] = y[i] + h / 6.0 * (w[0, i] + 2.0 * w[1, i] + 2.0 * w[2, i] + w[3, i])


@compilable
def _tangent_step(
    s: Any,
    h: float,
    touching: bool,
    p: int,
    bed: Any,
    ball: Any,
    mass: Any,
    by_bed: Any,
    by_ball: Any,
    w: Any,
    v: Any,
    new: Any,
) -> None:
    """The derivative of `_step`, at the stages that it left in w; v (3, 24, n) is scratch."""
    count = s.shape[1]
    slope, stage_s, total = v[0], v[1], v[2]
    for i in range(24):
        for a in range(count):
            total[i, a] = 0.0
            stage_s[i, a] = s[i, a]
    for stage in range(4):
        tangent_rates(
            w[4 + stage], stage_s, touching, p, bed, ball, mass, by_bed, by_ball, w[8:], slope
        )
        weight = 1.0 if stage in (0, 3) else 2.0
        part = h if stage == 2 else 0.5 * h
        for i in range(24):
            for a in range(count):
                total[i, a] += weight * slope[i, a]
                stage_s[i, a] = s[i, a] + part * slope[i, a]
    for i in range(24):
        for a in range(count):
            new[i, a] = s[i, a] + h / 6.0 * total[i, a]


@compilable
def _force_rate(y: Any, f: Any, p: int, ball: Any) -> Any:
    """dN/dt (N/s) at a state y with rates f."""
    return -ball[0] * (y[23] - y[9 + p]) - ball[1] * (f[23] - f[9 + p])


@compilable
def _sign(kind: int, y: Any, p: int, bed: Any, ball: Any, mass: Any, w: Any) -> Any:
    """What is zero at an event: raw normal force, gap, rate of the struck mass, rate of N."""
    at, moving = relative(y, p)
    if kind == RELEASE:
        return contact_law(at, moving, ball)[3]
    if kind == GAP:
        return at[2]
    if kind == TURN:
        return y[9 + p]
    rates(y, True, p, bed, ball, mass, w[8:], w[1])
    return _force_rate(y, w[1], p, ball)


@compilable
def _locate(
    kind: int,
    y: Any,
    h: float,
    touching: bool,
    p: int,
    bed: Any,
    ball: Any,
    mass: Any,
    w: Any,
    new: Any,
) -> Any:
    """The part of h after which the event is, by regula falsi (Illinois); `new` is there."""
    low, high = 0.0, h
    at_low = _sign(kind, y, p, bed, ball, mass, w)
    _step(y, h, touching, p, bed, ball, mass, w, new)
    at_high = _sign(kind, new, p, bed, ball, mass, w)
    scale = max(abs(at_low), abs(at_high))
    middle, side = high, 0
    for _ in range(60):
        middle = (low * at_high - high * at_low) / (at_high - at_low)
        _step(y, middle, touching, p, bed, ball, mass, w, new)
        value = _sign(kind, new, p, bed, ball, mass, w)
        if abs(value) <= 1e-13 * scale or high - low < 1e-15:
            break
        if (value > 0.0) == (at_high > 0.0):
            high, at_high = middle, value
            if side == 1:  # the other end has stayed twice: it would stay for long
                at_low *= 0.5
            side = 1
        else:
            low, at_low = middle, value
            if side == -1:
                at_high *= 0.5
            side = -1
    return middle


@compilable
def _reach(y: Any, p: int, bed: Any, mass: Any, stiffness: Any) -> float:
    """How far (m) the struck mass can come out."""
    energy = 0.0
    for i in range(9):
        energy += 0.5 * mass[1] * y[9 + i] * y[9 + i]
    for s in range(24):
        dz = y[FIRST[s]]
        if SECOND[s] >= 0:
            dz -= y[SECOND[s]]
        energy += spring_energy(dz, bed[0, s], bed[1, s], bed[2, s])
    return math.sqrt(2.0 * energy / stiffness[p])


@compilable
def _enter_peak(
    kind: int, y: Any, s: Any, p: int, ball: Any, by_ball: Any, out: Any, jacobian: Any
) -> None:
    """Enters the struck mass's deflection or the normal force, if it is the largest so far."""
    at, moving = relative(y, p)
    row = 5 if kind == TURN else 4
    size = -y[p] if kind == TURN else contact_law(at, moving, ball)[2]
    if size <= out[row]:
        return
    out[row] = size
    for a in range(s.shape[1]):
        if kind == TURN:
            jacobian[row, a] = -s[p, a]
        else:
            jacobian[row, a] = force_by_theta(y, s, a, p, ball, by_ball)


@compilable
def _impact(
    p: int,
    velocity: Any,
    bed: Any,
    ball: Any,
    mass: Any,
    stiffness: Any,
    by_bed: Any,
    by_ball: Any,
    h: float,
    out: Any,
    jacobian: Any,
) -> None:
    """One impact from first touch on; results into `out` (8,) and `jacobian` (6, n)."""
    count = by_ball.shape[1]
    y, new, f, w = np.zeros(24), np.empty(24), np.empty(24), np.empty((15, 24))
    s, s_new, v = np.zeros((24, count)), np.empty((24, count)), np.empty((3, 24, count))
    y[21], y[22], y[23] = velocity[0], velocity[1], velocity[2]
    out[4], out[5] = -ball[1] * velocity[2], 0.0
    for a in range(count):
        jacobian[4, a] = -velocity[2] * by_ball[1, a]
        jacobian[5, a] = 0.0
    touching, behind, touches, t = True, False, 1, 0.0
    rates(y, touching, p, bed, ball, mass, w[8:], w[0])
    crest = _force_rate(y, w[0], p, ball)
    while t < LONGEST:
        _step(y, h, touching, p, bed, ball, mass, w, new)
        if touching:
            # peaks lie inside the step; they do not change its course
            rates(new, True, p, bed, ball, mass, w[8:], f)
            rate = _force_rate(new, f, p, ball)
            for kind in (TURN, CREST):
                turned = y[9 + p] < 0.0 <= new[9 + p] if kind == TURN else crest > 0.0 >= rate
                if turned:
                    part = _locate(kind, y, h, touching, p, bed, ball, mass, w, new)
                    if count:
                        _tangent_step(
                            s, part, touching, p, bed, ball, mass, by_bed, by_ball, w, v, s_new
                        )
                    _enter_peak(kind, new, s_new, p, ball, by_ball, out, jacobian)
                    _step(y, h, touching, p, bed, ball, mass, w, new)
            crest = rate
        part, event = h, False
        if touching and _sign(RELEASE, new, p, bed, ball, mass, w) <= 0.0:
            part, event = _locate(RELEASE, y, h, touching, p, bed, ball, mass, w, new), True
        elif not touching and not behind and new[20] - new[p] <= 0.0:
            part, event = _locate(GAP, y, h, touching, p, bed, ball, mass, w, new), True
        if count:
            _tangent_step(s, part, touching, p, bed, ball, mass, by_bed, by_ball, w, v, s_new)
        t += part
        for i in range(24):
            y[i] = new[i]
            for a in range(count):
                s[i, a] = s_new[i, a]
        at, moving = relative(y, p)
        released, touched = event and touching, event and not touching
        if released or not (event or touching):
            rates(y, False, p, bed, ball, mass, w[8:], f)
        if released:
            touching, behind = False, at[2] < 0.0
            rates(y, True, p, bed, ball, mass, w[8:], w[0])
            rate = _force_rate(y, w[0], p, ball)
            out[3] = t
            for a in range(count):
                jacobian[3, a] = -force_by_theta(y, s, a, p, ball, by_ball) / rate
        elif touched:
            touching, touches = True, touches + 1
            rates(y, False, p, bed, ball, mass, w[8:], w[0])
            rates(y, True, p, bed, ball, mass, w[8:], f)
            for a in range(count):
                dt = -(s[20, a] - s[p, a]) / moving[2]
                for i in range(24):
                    s[i, a] += (w[0, i] - f[i]) * dt
            crest = _force_rate(y, f, p, ball)
        elif behind and at[2] >= 0.0:
            behind = False
        w[0] = f  # the rates at y
        if not (touching or behind) and y[23] > 0.0 and y[20] > _reach(y, p, bed, mass, stiffness):
            out[ENDED] = 1.0
            break
    for i in range(3):
        out[i] = y[21 + i]
        for a in range(count):
            jacobian[i, a] = s[21 + i, a]
    out[TOUCHES] = touches


def _batch(stamp: int) -> Any:
    """The compiled loop over impacts; `stamp` makes numba's cache see changes in the laws."""

    def run_batch(
        bed_of: Any,
        points: Any,
        velocities: Any,
        beds: Any,
        balls: Any,
        masses: Any,
        stiffness: Any,
        by_bed: Any,
        by_ball: Any,
        h: float,
        out: Any,
        jacobian: Any,
    ) -> int:
        for m in parallel_range(len(points)):
            b = bed_of[m]
            _impact(
                points[m],
                velocities[m],
                beds[b],
                balls[m],
                masses[b],
                stiffness[b],
                by_bed[b],
                by_ball[m],
                h,
                out[m],
                jacobian[m],
            )
        return stamp

    return compiled(run_batch, parallel=True, error_model="numpy")


run_batch = _batch(sources_stamp(strings, contact, clamped_ode))
