"""Steps a clamped impact through time: Runge-Kutta, its derivative, and events within a step.

The arguments that recur: y, the state of `ode`; p, the struck mass (0-based); ends, bed, ball and
mass as of `ode.rates`; w (8, states), rows 0-3 the slopes of a step, of which the first is given,
and rows 4-7 its stages; g (7, springs), scratch.
"""

from __future__ import annotations

import math
from typing import Any

from drake_racket.engines.clamped.ode import masses, rates, relative, tangent_rates
from drake_racket.laws.compilation import compilable
from drake_racket.laws.contact import contact_law, normal_slopes
from drake_racket.laws.strings import spring_energy

RELEASE, GAP, TURN, CREST = range(4)
"""Kinds of events: end of the force, touch, largest deflection, largest force."""


@compilable
def step(
    y: Any,
    h: float,
    touching: bool,
    p: int,
    ends: Any,
    bed: Any,
    ball: Any,
    mass: Any,
    w: Any,
    g: Any,
    new: Any,
) -> None:
    """Takes one Runge-Kutta step of y into `new`."""
    for i in range(len(y)):
        w[4, i] = y[i]
    for stage in range(1, 4):
        part = h if stage == 3 else 0.5 * h
        for i in range(len(y)):
            w[4 + stage, i] = y[i] + part * w[stage - 1, i]
        rates(w[4 + stage], touching, p, ends, bed, ball, mass, g, w[stage])
    for i in range(len(y)):
        new[i] = y[i] + h / 6.0 * (w[0, i] + 2.0 * w[1, i] + 2.0 * w[2, i] + w[3, i])


@compilable
def tangent_step(
    s: Any,
    h: float,
    touching: bool,
    p: int,
    ends: Any,
    bed: Any,
    ball: Any,
    mass: Any,
    by_bed: Any,
    by_ball: Any,
    w: Any,
    g: Any,
    v: Any,
    new: Any,
) -> None:
    """Gives derivative of `step`, at the stages that it left in w; v (3, states, n) is scratch."""
    size, count = s.shape
    slope, stage_s, total = v[0], v[1], v[2]
    for i in range(size):
        for a in range(count):
            total[i, a] = 0.0
            stage_s[i, a] = s[i, a]
    for stage in range(4):
        tangent_rates(
            w[4 + stage], stage_s, touching, p, ends, bed, ball, mass, by_bed, by_ball, g, slope
        )
        weight = 1.0 if stage in (0, 3) else 2.0
        part = h if stage == 2 else 0.5 * h
        for i in range(size):
            for a in range(count):
                total[i, a] += weight * slope[i, a]
                stage_s[i, a] = s[i, a] + part * slope[i, a]
    for i in range(size):
        for a in range(count):
            new[i, a] = s[i, a] + h / 6.0 * total[i, a]


@compilable
def force_rate(y: Any, f: Any, p: int, ball: Any) -> Any:
    """Gives dN/dt (N/s) at a state y with rates f."""
    n = masses(y)
    v, a = 2 * n + 5, n + p
    at, moving = relative(y, p)
    kx, cx = normal_slopes(-at[2], -moving[2], ball[0], ball[1], ball[7], ball[8])
    return -kx * (y[v] - y[a]) - cx * (f[v] - f[a])


@compilable
def sign(
    kind: int, y: Any, p: int, ends: Any, bed: Any, ball: Any, mass: Any, w: Any, g: Any
) -> Any:
    """Tells what is zero at an event: raw normal force, gap, rate of the struck mass, rate of N."""
    at, moving = relative(y, p)
    if kind == RELEASE:
        return contact_law(at, moving, ball)[3]
    if kind == GAP:
        return at[2]
    if kind == TURN:
        return y[masses(y) + p]
    rates(y, True, p, ends, bed, ball, mass, g, w[1])
    return force_rate(y, w[1], p, ball)


@compilable
def locate(
    kind: int,
    y: Any,
    h: float,
    touching: bool,
    p: int,
    ends: Any,
    bed: Any,
    ball: Any,
    mass: Any,
    w: Any,
    g: Any,
    new: Any,
) -> Any:
    """Gives the part of h after which the event is, by regula falsi (Illinois); `new` is there."""
    low, high = 0.0, h
    at_low = sign(kind, y, p, ends, bed, ball, mass, w, g)
    step(y, h, touching, p, ends, bed, ball, mass, w, g, new)
    at_high = sign(kind, new, p, ends, bed, ball, mass, w, g)
    scale = max(abs(at_low), abs(at_high))
    middle, side = high, 0
    for _ in range(60):
        middle = (low * at_high - high * at_low) / (at_high - at_low)
        step(y, middle, touching, p, ends, bed, ball, mass, w, g, new)
        value = sign(kind, new, p, ends, bed, ball, mass, w, g)
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
def reach(y: Any, p: int, ends: Any, bed: Any, mass: Any, stiffness: Any) -> float:
    """Tells how far (m) the struck mass can come out."""
    energy, n = 0.0, masses(y)
    for i in range(n):
        energy += 0.5 * mass[1] * y[n + i] * y[n + i]
    for s in range(ends.shape[1]):
        dz = y[ends[0, s]]
        if ends[1, s] >= 0:
            dz -= y[ends[1, s]]
        energy += spring_energy(dz, bed[0, s], bed[1, s], bed[2, s])
    return math.sqrt(2.0 * energy / stiffness[p])
