"""Runs one impact on a string-bed whose head is clamped, as compiled loops.

`ode` has the equations, made of the laws of the Drake systems; `steps` has the steps. Touch is at
t = 0. A step is Runge-Kutta of order 4; release, a second touch and the peaks are placed inside a
step by root finding. The run ends when the ball is out of reach: the energy E left in the bed
cannot lift the struck mass above sqrt(2 E / K), K its static stiffness without the springs' k,
which only adds.

Sensitivities s = dy/dtheta go through the same Runge-Kutta steps: they are the exact derivatives of
the computed states at a fixed time. Where the force jumps (a second touch at t_e) s jumps by
(f_before - f_after) dt_e/dtheta. At release the force is 0 on both sides.

Touch and release are those of `laws.phases`, on a record like a BallContact's; the bed has no rim
here that a ball could miss. Without numba the same source runs as plain Python: it gives the same
numbers, but takes 0.1 s for an impact, and 1 s with the sensitivities of a fit.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drake_racket.engines.clamped import ode, steps
from drake_racket.engines.clamped.ode import force_by_theta, rates, relative
from drake_racket.engines.clamped.steps import (
    CREST,
    GAP,
    RELEASE,
    TURN,
    force_rate,
    locate,
    reach,
    step,
    tangent_step,
)
from drake_racket.laws import contact, phases, strings
from drake_racket.laws.compilation import (
    compilable,
    compiled,
    makes_arrays,
    parallel_range,
    sources_stamp,
)
from drake_racket.laws.contact import CONTACT, FREE, contact_law
from drake_racket.laws.phases import AT_BALL, KB, PHASE, SIZE, latch, next_phase, release

OUTPUTS = ("v_x", "v_y", "v_z", "contact_time", "peak_normal_force", "peak_deflection")
"""Rebound velocity (m/s, in the head), first touch to last release (s), N, m (struck mass)."""

TOUCHES, ENDED = 6, 7
"""Columns after OUTPUTS: number of touches; 1 if the ball was out of reach within LONGEST."""

LONGEST = 0.03
"""s; contacts take 3 to 6 ms."""


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
def _coming_phase(record: Any, y: Any, new: Any, p: int, ball: Any) -> Any:
    """The phase at the end of a step from y to `new`."""
    before, _ = relative(y, p)
    at, moving = relative(new, p)
    fell = at[2] - before[2]
    raw = contact_law(at, moving, ball)[3] if record[PHASE] == CONTACT else 0.0
    return next_phase(record[PHASE], at[2], fell, raw, True)


@makes_arrays
def _impact(
    p: int,
    velocity: Any,
    ends: Any,
    bed: Any,
    constants: Any,
    mass: Any,
    stiffness: Any,
    by_bed: Any,
    by_constants: Any,
    h: float,
    out: Any,
    jacobian: Any,
) -> None:
    """One impact from first touch on; results into `out` (8,) and `jacobian` (6, n)."""
    count = by_constants.shape[1]
    n = len(stiffness)
    size, b = 2 * n + 6, 2 * n
    y, new, f = np.zeros(size), np.empty(size), np.empty(size)
    w, g = np.empty((8, size)), np.empty((7, ends.shape[1]))
    s, s_new, v = np.zeros((size, count)), np.empty((size, count)), np.empty((3, size, count))
    by_ball = np.zeros((5, count))  # the offset is 0 at first touch
    by_ball[:3] = by_constants
    record = np.zeros(SIZE)
    ball = record[KB:AT_BALL]
    for i in range(3):
        y[b + 3 + i] = velocity[i]
    at, moving = relative(y, p)
    kb, cb, mu, hb, db = constants[0], constants[1], constants[2], constants[7], constants[8]
    scale, by_displacement = constants[5], constants[6]
    latch(record, p + 1, at, moving, 0.0, kb, cb, mu, scale, by_displacement, 1.0, hb, db)
    out[4], out[5] = -ball[1] * velocity[2], 0.0
    for a in range(count):
        jacobian[4, a] = -velocity[2] * by_ball[1, a]
        jacobian[5, a] = 0.0
    t = 0.0
    rates(y, True, p, ends, bed, ball, mass, g, w[0])
    crest = force_rate(y, w[0], p, ball)
    while t < LONGEST:
        touching = record[PHASE] == CONTACT
        step(y, h, touching, p, ends, bed, ball, mass, w, g, new)
        if touching:
            # peaks lie inside the step; they do not change its course
            rates(new, True, p, ends, bed, ball, mass, g, f)
            rate = force_rate(new, f, p, ball)
            for kind in (TURN, CREST):
                turned = y[n + p] < 0.0 <= new[n + p] if kind == TURN else crest > 0.0 >= rate
                if turned:
                    part = locate(kind, y, h, touching, p, ends, bed, ball, mass, w, g, new)
                    if count:
                        tangent_step(
                            s,
                            part,
                            touching,
                            p,
                            ends,
                            bed,
                            ball,
                            mass,
                            by_bed,
                            by_ball,
                            w,
                            g,
                            v,
                            s_new,
                        )
                    _enter_peak(kind, new, s_new, p, ball, by_ball, out, jacobian)
                    step(y, h, touching, p, ends, bed, ball, mass, w, g, new)
            crest = rate
        coming = _coming_phase(record, y, new, p, ball)
        released, touched = touching and coming != CONTACT, not touching and coming == CONTACT
        part = h
        if released or touched:
            kind = RELEASE if released else GAP
            part = locate(kind, y, h, touching, p, ends, bed, ball, mass, w, g, new)
        if count:
            tangent_step(
                s, part, touching, p, ends, bed, ball, mass, by_bed, by_ball, w, g, v, s_new
            )
        t += part
        for i in range(size):
            y[i] = new[i]
            for a in range(count):
                s[i, a] = s_new[i, a]
        at, moving = relative(y, p)
        if released or not (touched or touching):
            rates(y, False, p, ends, bed, ball, mass, g, f)
        if released:
            release(record, at, t)
            rates(y, True, p, ends, bed, ball, mass, g, w[0])
            rate = force_rate(y, w[0], p, ball)
            for a in range(count):
                jacobian[3, a] = -force_by_theta(y, s, a, p, ball, by_ball) / rate
        elif touched:
            latch(record, p + 1, at, moving, t, kb, cb, mu, scale, by_displacement, 1.0, hb, db)
            rates(y, False, p, ends, bed, ball, mass, g, w[0])
            rates(y, True, p, ends, bed, ball, mass, g, f)
            for a in range(count):
                dt = -(s[b + 2, a] - s[p, a]) / moving[2]
                for i in range(2):
                    by_ball[3 + i, a] = s[b + i, a] + y[b + 3 + i] * dt
                for i in range(size):
                    s[i, a] += (w[0, i] - f[i]) * dt
            crest = force_rate(y, f, p, ball)
        else:
            record[PHASE] = coming
        w[0] = f  # the rates at y
        out_of_reach = record[PHASE] == FREE and y[b + 5] > 0.0
        if out_of_reach and y[b + 2] > reach(y, p, ends, bed, mass, stiffness):
            out[ENDED] = 1.0
            break
    for i in range(3):
        out[i] = y[b + 3 + i]
        for a in range(count):
            jacobian[i, a] = s[b + 3 + i, a]
    out[3], out[TOUCHES] = record[phases.RELEASE], record[phases.TOUCHES]


def _batch(stamp: int) -> Any:
    """The compiled loop over impacts; `stamp` makes numba's cache see changes in the laws."""

    def run_batch(
        bed_of: Any,
        points: Any,
        velocities: Any,
        ends: Any,
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
                ends,
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

    return compiled(run_batch, parallel=True)


run_batch = _batch(sources_stamp(strings, contact, phases, ode, steps))
