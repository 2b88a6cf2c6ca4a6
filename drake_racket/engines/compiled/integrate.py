"""Integrates one case of a model in time, with touch, release and leaving as located events.

Events lie inside a step: it is taken again with the length that ends at the event, found by regula
falsi on the gap or on the normal force.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.engines.compiled.dynamics.events import dips, pass_event, update, watched
from drake_racket.engines.compiled.dynamics.friction import friction_at, linearise, solve_sliding
from drake_racket.engines.compiled.dynamics.rates import move, rates
from drake_racket.engines.compiled.steps import (
    ARK_B,
    ARK_C,
    ARK_E,
    ARK_ERROR,
    ARK_GAMMA,
    ARK_I,
    DP_A,
    DP_ERROR,
    add_columns,
    along,
    combine,
    damped_error_of,
    error_of,
)
from drake_racket.laws.compilation import compilable
from drake_racket.laws.contact import CONTACT, FREE, PASSED
from drake_racket.laws.phases import BY_DISPLACEMENT, CONSTANTS, PHASE

FINISHED, FULL, STUCK, NOT_FINITE = range(4)
"""How a run ended: at its end; out of room for samples; with steps too short; with NaN."""

SHORTEST = 1e-13  # s, below which a step is not shortened any more


@compilable
def stiff_contact(records: Any) -> int:
    """The contact whose friction is taken implicitly: the first one in contact; -1 for none.

    The reading by displacement is not stiff, and is taken explicitly.
    """
    for i in range(len(records)):
        if records[i, PHASE] == CONTACT and records[i, BY_DISPLACEMENT] < 0.5:
            return i
    return -1


@compilable
def _explicit(
    ints: Any, floats: Any, model: Any, y: Any, h: float, records: Any, s: Any, new: Any
) -> None:
    """A step of Dormand and Prince; the first slope is given, the last is that of the next step."""
    origin, w, leaves, tau, k = s[0], s[1], s[2], s[3], s[4]
    for stage in range(1, 7):
        combine(y, h, k, DP_A[stage], stage, new)
        rates(ints, floats, model, new, records, origin, w, leaves, tau, k[stage])


@compilable
def _additive(
    ints: Any, floats: Any, model: Any, y: Any, h: float, records: Any, s: Any, new: Any
) -> None:
    """A step of ARK4(3)6L[2]SA; the first slope and what `linearise` wrote are given."""
    origin, w, leaves, tau, k = s[0], s[1], s[2], s[3], s[4]
    rows, columns, law, inner, g = s[5], s[6], s[7], s[8], s[9]
    nq, nv = ints[at.POSITIONS], ints[at.VELOCITIES]
    constants = records[stiff_contact(records), CONSTANTS]
    base0, base1 = along(rows, y[nq : nq + nv])
    base0, base1 = law[0] - base0, law[1] - base1
    for stage in range(1, 6):
        combine(y, h, k, ARK_E[stage], stage, new)
        v = new[nq : nq + nv]
        g0, g1 = 0.0, 0.0
        for j in range(stage):
            weight = ARK_I[stage, j] - ARK_E[stage, j]
            g0 += weight * g[j, 0]
            g1 += weight * g[j, 1]
        add_columns(v, columns, h * g0, h * g1)
        s0, s1 = along(rows, v)
        time = ARK_C[stage] * h
        square = 0.5 * time * time
        s0 += base0 + time * law[2] + square * law[6]
        s1 += base1 + time * law[3] + square * law[7]
        normal = law[4] + time * law[5] + square * law[8]
        g0, g1, g[6, 0], g[6, 1] = solve_sliding(s0, s1, ARK_GAMMA * h, inner, normal, constants)
        add_columns(v, columns, ARK_GAMMA * h * g0, ARK_GAMMA * h * g1)
        g[stage, 0], g[stage, 1] = g0, g1
        rates(ints, floats, model, new, records, origin, w, leaves, tau, k[stage])
    combine(y, h, k, ARK_B, 6, new)


@compilable
def take(
    ints: Any,
    floats: Any,
    model: Any,
    y: Any,
    h: float,
    records: Any,
    stiff: bool,
    s: Any,
    new: Any,
) -> None:
    """Takes one step from y into `new`; leaves the motion there in the work rows."""
    if stiff:
        _additive(ints, floats, model, y, h, records, s, new)
        move(model, floats, new, ints[at.POSITIONS], s[0], s[1], s[2])
    else:
        _explicit(ints, floats, model, y, h, records, s, new)


@compilable
def _locate(
    ints: Any,
    floats: Any,
    model: Any,
    y: Any,
    h: float,
    records: Any,
    stiff: bool,
    s: Any,
    new: Any,
    i: int,
    at_low: float,
    at_high: float,
) -> Any:
    """Length of the step that ends at the event of contact i, by regula falsi (Illinois)."""
    low, high, side = 0.0, h, 0
    scale = max(abs(at_low), abs(at_high))
    middle, taken = h, 0
    for _ in range(60):
        middle = (low * at_high - high * at_low) / (at_high - at_low)
        take(ints, floats, model, y, middle, records, stiff, s, new)
        taken += 1
        value, _ = watched(model, i, records, s[1], s[2])
        if abs(value) <= 1e-14 * scale or high - low < SHORTEST:
            break
        if (value > 0.0) == (at_high > 0.0):
            high, at_high = middle, value
            if side == 1:
                at_low *= 0.5
            side = 1
        else:
            low, at_low = middle, value
            if side == -1:
                at_high *= 0.5
            side = -1
    return middle, taken


@compilable
def _new_work(ints: Any, size: int) -> Any:
    nv = ints[at.VELOCITIES]
    return (
        np.zeros(3),
        np.zeros((ints[at.NODES], at.NODE_WORK)),
        np.zeros((ints[at.LEAVES], at.LEAF_WORK)),
        np.zeros(nv),
        np.zeros((7, size)),
        np.zeros((2, nv)),
        np.zeros((2, nv)),
        np.zeros(9),
        np.zeros((2, 2)),
        np.zeros((7, 2)),
        np.zeros(size),
    )


@compilable
def integrate(
    ints: Any,
    floats: Any,
    y: Any,
    records: Any,
    end: float,
    accuracy: float,
    longest: float,
    controlled: bool,
    scale: Any,
    samples: Any,
    sampled: Any,
) -> Any:
    """Integrates one case to its end; y and records are those of the end then.

    Args:
        y: [q; v; totals] at the start.  records: (contacts, 15) of `laws.phases` at the start.
        end: s.  accuracy: of a step, in units of 1 / scale.  longest: step (s); the length of all
            steps where they are not controlled.
        scale: (len(y),) weights of errors.
        samples: (n, 1 + len(y)) time and state are written here, at the start and after each step;
            of no rows: nothing is kept.
        sampled: (n, contacts, 15) the records at these times.

    Returns:
        number of samples, steps, evaluations, and how it ended.

    """
    model = at.open_model(ints, floats)
    size, contacts = len(y), len(records)
    s = _new_work(ints, size)
    origin, w, leaves, tau, k = s[0], s[1], s[2], s[3], s[4]
    rows, columns, law, inner = s[5], s[6], s[7], s[8]
    new = np.empty(size)
    gaps, slopes = np.zeros((2, contacts)), np.zeros((2, contacts))
    time, count, steps, evaluations = 0.0, 0, 0, 0
    move(model, floats, y, ints[at.POSITIONS], origin, w, leaves)
    for i in range(contacts):
        update(model, i, time, records, w, leaves)
    keep = len(samples) > 0
    h, fresh, stiff, slid = min(longest, 1e-5), False, False, 0.0
    if not controlled:
        h = longest
    while True:
        if keep:
            if count == len(samples):
                return count, steps, evaluations, FULL
            samples[count, 0] = time
            samples[count, 1:] = y
            sampled[count] = records
            count += 1
        if time >= end:
            return count, steps, evaluations, FINISHED
        if not fresh:
            rates(ints, floats, model, y, records, origin, w, leaves, tau, k[0])
            evaluations += 1
        which = stiff_contact(records)
        stiff = which >= 0
        if stiff:
            f = k[0, ints[at.POSITIONS] : ints[at.POSITIONS] + ints[at.VELOCITIES]]
            l0, l1, l2 = law[2], law[3], law[5]
            linearise(model, which, records[which], w, leaves, f, columns, rows, law)
            law[6], law[7], law[8] = 0.0, 0.0, 0.0
            if slid > 0.0:
                law[6], law[7] = (law[2] - l0) / slid, (law[3] - l1) / slid
                law[8] = (law[5] - l2) / slid
            g0, g1, _, _, _ = friction_at(law[0], law[1], law[4], records[which, CONSTANTS])
            s[9][0, 0], s[9][0, 1] = g0, g1
            for a in range(2):
                for b in range(2):
                    total = 0.0
                    for j in range(len(tau)):
                        total += rows[a, j] * columns[b, j]
                    inner[a, b] = total
        for i in range(contacts):
            gaps[0, i], slopes[0, i] = watched(model, i, records, w, leaves)
        while True:  # until a step is good enough
            last = time + h >= end - 1e-15
            part = end - time if last else h
            take(ints, floats, model, y, part, records, stiff, s, new)
            evaluations += 5 if stiff else 6
            size_of_error = 0.0
            if stiff:
                c = records[which, CONSTANTS]
                _, _, g00, g01, g11 = friction_at(s[9][6, 0], s[9][6, 1], law[4] + part * law[5], c)
                size_of_error = damped_error_of(
                    part,
                    k,
                    ARK_ERROR,
                    scale,
                    ints[at.POSITIONS],
                    rows,
                    columns,
                    inner,
                    g00,
                    g01,
                    g11,
                    ARK_GAMMA,
                    s[10],
                )
            else:
                size_of_error = error_of(part, k, DP_ERROR, 7, scale)
            if not math.isfinite(size_of_error):
                if part < 1e-9:
                    return count, steps, evaluations, NOT_FINITE
                h = 0.25 * part
                continue
            order = 4.0 if stiff else 5.0
            factor = 5.0
            if size_of_error > 0.0:
                factor = min(5.0, max(0.2, 0.9 * (accuracy / size_of_error) ** (1.0 / order)))
            if controlled and size_of_error > accuracy:
                if part < SHORTEST:
                    return count, steps, evaluations, STUCK
                h = part * min(factor, 0.9)
                continue
            dipped = False
            for i in range(contacts):
                gaps[1, i], slopes[1, i] = watched(model, i, records, w, leaves)
                if records[i, PHASE] == FREE and part > 1e-9:
                    dipped = dipped or dips(
                        gaps[0, i], slopes[0, i], gaps[1, i], slopes[1, i], part
                    )
            if dipped:
                h = 0.25 * part
                continue
            break
        if controlled:
            h = min(longest, max(h, part * factor) if last else part * factor)
        event, first = -1, part
        for i in range(contacts):
            phase, before, after = records[i, PHASE], gaps[0, i], gaps[1, i]
            happens = before < 0.0 <= after if phase == PASSED else before > 0.0 >= after
            if happens:
                length, tries = _locate(
                    ints, floats, model, y, part, records, stiff, s, new, i, before, after
                )
                evaluations += tries * (5 if stiff else 6)
                if length <= first:
                    event, first = i, length
        if event >= 0:
            take(ints, floats, model, y, first, records, stiff, s, new)
            part, last = first, last and first >= part
        steps += 1
        time = end if last else time + part
        for i in range(size):
            y[i] = new[i]
        fresh = False
        slid = part if stiff and event < 0 else 0.0
        if event >= 0:
            pass_event(model, event, time, records, w, leaves)
            if controlled:
                h = min(h, 2e-5)
        elif not stiff:
            for i in range(size):
                k[0, i] = k[6, i]
            fresh = True
