"""The batch of `clamped_kernel` on arrays over impacts, for machines without numba.

The same equations, laws, steps and events; every array has the impacts first. Impacts that have an
event within a step take a shorter one, and so each keeps its own time.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.engines.clamped.kernel import CREST, ENDED, GAP, LONGEST, RELEASE, TOUCHES, TURN
from drake_racket.laws.strings import INCIDENCE, spring_energy, spring_law, spring_partials

Array = NDArray[np.float64]


class _Batch:
    """The constants of all impacts, and the rates of their states and sensitivities."""

    def __init__(self, points: Any, beds: Any, balls: Any, masses: Any, stiffness: Any) -> None:
        self.points, self.balls, self.masses = points, balls, masses
        self.bed = np.moveaxis(beds, 1, 0)  # (4, m, 24)
        self.stiffness = stiffness

    def part(self, rows: Any) -> _Batch:
        """The batch of some of the impacts."""
        new = _Batch.__new__(_Batch)
        new.points, new.balls, new.masses = self.points[rows], self.balls[rows], self.masses[rows]
        new.bed, new.stiffness = self.bed[:, rows], self.stiffness[rows]
        return new

    def relative(self, y: Array) -> tuple[Array, Array]:
        """p_SQ and v_SQ, (3, m)."""
        at, moving = y[:, 18:21].T.copy(), y[:, 21:24].T.copy()
        rows = np.arange(len(y))
        at[2] -= y[rows, self.points]
        moving[2] -= y[rows, 9 + self.points]
        return at, moving

    def contact(self, y: Array) -> tuple[Array, ...]:
        """N, u_x, u_y, e_x, e_y, mu N / r and raw: `contact_partials` on arrays."""
        at, moving = self.relative(y)
        kb, cb, mu, x0, y0, scale, by_displacement = self.balls.T
        raw = -kb * at[2] - cb * moving[2]
        normal = np.maximum(raw, 0.0)
        tx = np.where(by_displacement > 0.5, at[0] - x0, moving[0])
        ty = np.where(by_displacement > 0.5, at[1] - y0, moving[1])
        r = np.sqrt(tx * tx + ty * ty + scale * scale)
        ex, ey = tx / r, ty / r
        return normal, -mu * ex, -mu * ey, ex, ey, mu * normal / r, raw

    def rates(self, y: Array, touching: Any) -> Array:
        """Rates y' (m, 24)."""
        f = np.zeros_like(y)
        f[:, :9], f[:, 18:21] = y[:, 9:18], y[:, 21:24]
        slope, tension = spring_law(y[:, :9] @ INCIDENCE.T, y[:, 9:18] @ INCIDENCE.T, *self.bed)
        ball, string = self.masses[:, 0], self.masses[:, 1]
        f[:, 9:18] = -(tension * slope) @ INCIDENCE / string[:, None]
        normal, ux, uy, *_, raw = self.contact(y)
        normal, raw = np.where(touching, normal, 0.0), np.where(touching, raw, 0.0)
        f[:, 21], f[:, 22], f[:, 23] = ux * normal / ball, uy * normal / ball, raw / ball
        f[np.arange(len(y)), 9 + self.points] -= raw / string
        return f

    def tangent_rates(self, y: Array, s: Array, touching: Any, by_bed: Any, by_ball: Any) -> Array:
        """The sensitivities' rates (m, 24, n)."""
        f = np.zeros_like(s)
        f[:, :9], f[:, 18:21] = s[:, 9:18], s[:, 21:24]
        partials = spring_partials(y[:, :9] @ INCIDENCE.T, y[:, 9:18] @ INCIDENCE.T, *self.bed)
        _, by_dz, by_rate, *by_constant = (x[..., None] for x in partials)
        pull = by_dz * (INCIDENCE @ s[:, :9]) + by_rate * (INCIDENCE @ s[:, 9:18])
        pull += sum(by_constant[i] * by_bed[:, i] for i in range(4))
        ball, string = self.masses[:, 0, None], self.masses[:, 1, None]
        f[:, 9:18] = -np.einsum("ri,mra->mia", INCIDENCE, pull) / string[..., None]
        normal, ux, uy, ex, ey, share, _ = (x[:, None] for x in self.contact(y))
        dn = np.where(touching[:, None], self.d_raw(y, s, by_ball), 0.0)
        by_displacement = self.balls[:, 6, None] > 0.5
        dtx = np.where(by_displacement, s[:, 18], s[:, 21])
        dty = np.where(by_displacement, s[:, 19], s[:, 22])
        along, d_mu = ex * dtx + ey * dty, normal * by_ball[:, 2]
        on = touching[:, None]
        f[:, 21] = np.where(on, ux * dn - ex * d_mu - share * (dtx - ex * along), 0.0) / ball
        f[:, 22] = np.where(on, uy * dn - ey * d_mu - share * (dty - ey * along), 0.0) / ball
        f[:, 23] = dn / ball
        f[np.arange(len(y)), 9 + self.points] -= dn / string
        return f

    def d_raw(self, y: Array, s: Array, by_ball: Any) -> Array:
        """d(kb x + cb x') / dtheta, (m, n)."""
        at, moving = self.relative(y)
        rows = np.arange(len(y))
        kb, cb = self.balls[:, 0, None], self.balls[:, 1, None]
        return np.asarray(
            -kb * (s[:, 20] - s[rows, self.points])
            - cb * (s[:, 23] - s[rows, 9 + self.points])
            - at[2][:, None] * by_ball[:, 0]
            - moving[2][:, None] * by_ball[:, 1]
        )

    def step(self, y: Array, h: Array, touching: Any) -> tuple[Array, list[Array]]:
        """One Runge-Kutta step, each impact with its own h (m,); and its stages."""
        h = h[:, None]
        stages, slopes = [y], [self.rates(y, touching)]
        for part in (0.5 * h, 0.5 * h, h):
            stages.append(y + part * slopes[-1])
            slopes.append(self.rates(stages[-1], touching))
        k1, k2, k3, k4 = slopes
        return np.asarray(y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)), stages

    def tangent_step(
        self, stages: list[Array], s: Array, h: Array, touching: Any, by_bed: Any, by_ball: Any
    ) -> Array:
        """The derivative of `step`."""
        h = h[:, None, None]
        slope = self.tangent_rates(stages[0], s, touching, by_bed, by_ball)
        total = slope.copy()
        for stage, part, weight in ((1, 0.5 * h, 2.0), (2, 0.5 * h, 2.0), (3, h, 1.0)):
            slope = self.tangent_rates(stages[stage], s + part * slope, touching, by_bed, by_ball)
            total += weight * slope
        return np.asarray(s + h / 6.0 * total)

    def sign(self, kind: int, y: Array) -> Array:
        """What is zero at an event; as in `clamped_kernel`."""
        at, moving = self.relative(y)
        rows = np.arange(len(y))
        if kind == RELEASE:
            return self.contact(y)[-1]
        if kind == GAP:
            return np.asarray(at[2])
        if kind == TURN:
            return np.asarray(y[rows, 9 + self.points])
        f = self.rates(y, np.ones(len(y), dtype=bool))
        bend = f[:, 23] - f[rows, 9 + self.points]
        return np.asarray(-self.balls[:, 0] * moving[2] - self.balls[:, 1] * bend)

    def locate(self, kind: int, y: Array, h: Array, touching: Any) -> Array:
        """The parts of h after which the event is, by regula falsi (Illinois)."""
        low, high = np.zeros(len(y)), h.copy()
        at_low, at_high = self.sign(kind, y), self.sign(kind, self.step(y, h, touching)[0])
        scale = np.maximum(np.abs(at_low), np.abs(at_high))
        found = np.zeros(len(y), dtype=bool)
        middle, side = high.copy(), np.zeros(len(y))
        for _ in range(60):
            trial = (low * at_high - high * at_low) / (at_high - at_low)
            middle = np.where(found, middle, trial)
            value = self.sign(kind, self.step(y, middle, touching)[0])
            found |= (np.abs(value) <= 1e-13 * scale) | (high - low < 1e-15)
            if found.all():
                break
            right = (value > 0.0) == (at_high > 0.0)
            move_high, move_low = right & ~found, ~right & ~found
            high, at_high = np.where(move_high, middle, high), np.where(move_high, value, at_high)
            at_low = np.where(move_high & (side > 0.0), 0.5 * at_low, at_low)
            low, at_low = np.where(move_low, middle, low), np.where(move_low, value, at_low)
            at_high = np.where(move_low & (side < 0.0), 0.5 * at_high, at_high)
            side = np.where(move_high, 1.0, np.where(move_low, -1.0, side))
        return middle

    def reach(self, y: Array) -> Array:
        """How far (m) each struck mass can come out."""
        k, slack, length2, _ = self.bed
        stored = spring_energy(y[:, :9] @ INCIDENCE.T, k, slack, length2).sum(axis=1)
        moving = 0.5 * self.masses[:, 1] * (y[:, 9:18] ** 2).sum(axis=1)
        rows = np.arange(len(y))
        return np.asarray(np.sqrt(2.0 * (stored + moving) / self.stiffness[rows, self.points]))


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
) -> None:
    """The same call as `clamped_kernel.run_batch`."""
    batch = _Batch(points, beds[bed_of], balls, masses[bed_of], stiffness[bed_of])
    by_bed = by_bed[bed_of]
    m, n = len(points), by_ball.shape[2]
    rows = np.arange(m)
    y, s = np.zeros((m, 24)), np.zeros((m, 24, n))
    y[:, 21:24] = velocities
    out[:, 4], out[:, 5], out[:, TOUCHES] = -balls[:, 1] * velocities[:, 2], 0.0, 1.0
    jacobian[:, 4] = -velocities[:, 2, None] * by_ball[:, 1]
    jacobian[:, 5] = 0.0
    touching, behind = np.ones(m, dtype=bool), np.zeros(m, dtype=bool)
    running, time = np.ones(m, dtype=bool), np.zeros(m)
    crest = batch.sign(CREST, y)
    while running.any():
        full = np.full(m, h)
        new, _ = batch.step(y, full, touching)
        rate = batch.sign(CREST, new)
        on = touching & running
        turned = on & (y[rows, 9 + points] < 0.0) & (new[rows, 9 + points] >= 0.0)
        crested = on & (crest > 0.0) & (rate <= 0.0)
        for kind, which, row in ((TURN, turned, 5), (CREST, crested, 4)):
            if which.any():
                _peak(
                    batch, kind, row, np.flatnonzero(which), y, s, h, by_bed, by_ball, out, jacobian
                )
        crest = np.where(touching, rate, crest)
        part = full
        released = on & (batch.sign(RELEASE, new) <= 0.0)
        touched = ~touching & ~behind & running & (new[:, 20] <= new[rows, points])
        for kind, which in ((RELEASE, released), (GAP, touched)):
            if which.any():
                sub = batch.part(which)
                part[which] = sub.locate(kind, y[which], full[which], touching[which])
        part = np.where(running, part, 0.0)
        y, stages = batch.step(y, part, touching)
        if n:
            s = batch.tangent_step(stages, s, part, touching, by_bed, by_ball)
        time += part
        at, moving = batch.relative(y)
        behind = np.where(released, at[2] < 0.0, behind & (at[2] < 0.0))
        if released.any():
            out[released, 3] = time[released]
            slope = batch.sign(CREST, y)[released, None]
            jacobian[released, 3] = -batch.d_raw(y, s, by_ball)[released] / slope
        if touched.any():
            before, after = (batch.rates(y, np.full(m, flag)) for flag in (False, True))
            dt = -(s[:, 20] - s[rows, points]) / moving[2][:, None]
            s += np.where(
                touched[:, None, None], (before - after)[:, :, None] * dt[:, None, :], 0.0
            )
            crest = np.where(touched, batch.sign(CREST, y), crest)
            out[touched, TOUCHES] += 1.0
        touching = (touching & ~released) | touched
        clear = ~touching & ~behind & (y[:, 23] > 0.0) & (y[:, 20] > batch.reach(y))
        out[running & clear, ENDED] = 1.0
        running = running & ~clear & (time < LONGEST)
    out[:, :3] = y[:, 21:24]
    jacobian[:, :3] = s[:, 21:24]


def _peak(
    batch: _Batch,
    kind: int,
    row: int,
    which: Any,
    y: Array,
    s: Array,
    h: float,
    by_bed: Any,
    by_ball: Any,
    out: Any,
    jacobian: Any,
) -> None:
    """Enters the peaks of deflection or force that some impacts (indices `which`) have passed."""
    sub = batch.part(which)
    on = np.ones(len(which), dtype=bool)
    part = sub.locate(kind, y[which], np.full(len(which), h), on)
    new, stages = sub.step(y[which], part, on)
    tangent = sub.tangent_step(stages, s[which], part, on, by_bed[which], by_ball[which])
    if kind == TURN:
        at = np.arange(len(which)), sub.points
        size, slope = -new[at], -tangent[at]
    else:
        size, slope = sub.contact(new)[0], sub.d_raw(new, tangent, by_ball[which])
    higher = size > out[which, row]
    out[which[higher], row] = size[higher]
    jacobian[which[higher], row] = slope[higher]
