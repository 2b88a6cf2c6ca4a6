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
from drake_racket.engines.compiled.dynamics.surface import is_surface
from drake_racket.engines.compiled.steps import (
    ARK_B,
    ARK_C,
    ARK_E,
    ARK_ERROR,
    ARK_GAMMA,
    ARK_I,
    DP_A,
    DP_C,
    DP_ERROR,
    add_columns,
    along,
    combine,
    damped_error_of,
    error_of,
)
from drake_racket.laws.compilation import compilable, makes_arrays
from drake_racket.laws.contact import CONTACT, FREE, PASSED
from drake_racket.laws.phases import BY_DISPLACEMENT, CONSTANTS, PHASE

FINISHED, FULL, STUCK, NOT_FINITE = range(4)
"""How a run ended: at its end; out of room for samples; with steps too short; with NaN."""

SHORTEST = 1e-13  # s, below which a step is not shortened any more
FIRST_STEP, AFTER_EVENT = 1e-5, 2e-5
"""s, of the first steps; the error control goes on from there."""
STEADY = 0.04
"""Weight of the last step's error in the length of the next; that of DOPRI5."""
OUT_OF_CONTACT = 10.0
"""How much larger an error may be where nothing is in contact: the ball flies, and what rings does
not change it. An impact's energy then closes as Drake's does at the same accuracy."""
LOCATED, NEARLY_LOCATED = 1e-14, 1e-7
"""Share of what it was before the step, below which a watched number is zero; and where contact
surface turns, releases or leaves: its force and shear are continuous there, so that an event that
is late by t changes the motion by t squared only."""


@compilable
def stiff_contact(records: Any) -> int:
    """The contact whose friction is taken implicitly: the first one in contact; -1 for none.

    The reading by displacement and contact surface are not stiff, and are taken explicitly.
    """
    for i in range(len(records)):
        if records[i, PHASE] == CONTACT and records[i, BY_DISPLACEMENT] < 0.5:
            return i
    return -1


@compilable
def touching(records: Any) -> bool:
    """Tells whether any contact is closed."""
    closed = False
    for i in range(len(records)):
        closed = closed or records[i, PHASE] == CONTACT
    return closed


@compilable
def take(
    model: Any,
    y: Any,
    h: float,
    records: Any,
    stiff: int,
    s: Any,
    new: Any,
) -> None:
    """Takes one step from y into `new`; leaves the motion there in the work rows.

    Args:
        stiff: the contact whose friction is split off, by ARK4(3)6L[2]SA: what `linearise` wrote is
            given; -1 for a step of Dormand and Prince, whose last slope is the next one's first.
        s: work; the first slope is given.

    """
    origin, w, leaves, tau, k = s[0], s[1], s[2], s[3], s[4]
    rows, columns, law, inner, g = s[5], s[6], s[7], s[8], s[9]
    nq, nv = model[at.HEAD][at.POSITIONS], model[at.HEAD][at.VELOCITIES]
    base0, base1 = 0.0, 0.0
    if stiff >= 0:
        base0, base1 = along(rows, y[nq : nq + nv])
        base0, base1 = law[0] - base0, law[1] - base1
    for stage in range(1, 7):
        if stiff < 0:
            combine(y, h, k, DP_A[stage], stage, new)
        elif stage < 6:
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
            constants = records[stiff, CONSTANTS]
            g0, g1, g[6, 0], g[6, 1] = solve_sliding(
                s0, s1, ARK_GAMMA * h, inner, normal, constants
            )
            add_columns(v, columns, ARK_GAMMA * h * g0, ARK_GAMMA * h * g1)
            g[stage, 0], g[stage, 1] = g0, g1
        else:
            combine(y, h, k, ARK_B, 6, new)
            move(model, new, nq, origin, w, leaves)
            return
        origin[at.CLOCK] = origin[at.STEP_CLOCK] + (DP_C[stage] if stiff < 0 else ARK_C[stage]) * h
        rates(model, new, records, origin, w, leaves, tau, k[stage])


@makes_arrays
def new_work(model: Any, size: int) -> Any:
    """Gives the work arrays of a run, in the order of `take`."""
    nv = model[at.HEAD][at.VELOCITIES]
    return (
        np.zeros(at.ORIGIN_WORK),
        np.zeros((model[at.HEAD][at.NODES], at.NODE_WORK)),
        np.zeros((model[at.HEAD][at.LEAVES], at.LEAF_WORK)),
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
def split_friction(model: Any, which: int, records: Any, s: Any, nq: int, slid: float) -> None:
    """Prepares the steps in contact: what `linearise` writes, and how fast that changes.

    Args:
        slid: length (s) of the last step of this contact, at whose start `linearise` was last
            called; 0 for none.

    """
    w, leaves, tau, k = s[1], s[2], s[3], s[4]
    rows, columns, law, inner, g = s[5], s[6], s[7], s[8], s[9]
    l0, l1, l2 = law[2], law[3], law[5]
    nv = len(tau)
    linearise(model, which, records[which], w, leaves, k[0, nq : nq + nv], columns, rows, law)
    law[6], law[7], law[8] = 0.0, 0.0, 0.0
    if slid > 0.0:
        law[6], law[7], law[8] = (law[2] - l0) / slid, (law[3] - l1) / slid, (law[5] - l2) / slid
    g[0, 0], g[0, 1], _, _, _ = friction_at(law[0], law[1], law[4], records[which, CONSTANTS])
    for a in range(2):
        for b in range(2):
            inner[a, b] = 0.0
            for j in range(nv):
                inner[a, b] += rows[a, j] * columns[b, j]


@compilable
def _error(part: float, stiff: int, records: Any, scale: Any, s: Any, nq: int) -> float:
    """The estimated error of the step just taken."""
    k, rows, columns, law, inner, g = s[4], s[5], s[6], s[7], s[8], s[9]
    if stiff < 0:
        error: float = error_of(part, k, DP_ERROR, 7, scale)
        return error
    normal = law[4] + part * law[5]
    _, _, a, b, d = friction_at(g[6, 0], g[6, 1], normal, records[stiff, CONSTANTS])
    damped: float = damped_error_of(
        part, k, ARK_ERROR, scale, nq, rows, columns, inner, a, b, d, ARK_GAMMA, s[10]
    )
    return damped


@compilable
def longer(used: float, before: float, order: float, refused: bool) -> float:
    """How much longer than a step the next one may be: 0.2 to 5 times.

    By this step's error and the last one's (as DOPRI5 of Hairer, Norsett & Wanner, Solving Ordinary
    Differential Equations I, section II.4): fewer steps at the border of stability are refused.

    Args:
        used: error of the step, of what is allowed.  before: of the last one, 1e-4 at least.
        order: of the error.  refused: the step has been refused when it was longer.

    """
    if used == 0.0:
        return 1.0 if refused else 5.0
    factor = 0.9 * used ** (0.75 * STEADY - 1.0 / order) * before**STEADY
    return float(min(1.0 if refused else 5.0, max(0.2, factor)))


@compilable
def first_event(records: Any, gaps: Any, known: int) -> int:
    """The event whose watched number passes zero first in a step, by straight lines; -1: none.

    Those of the contacts come first, then the turns between gripping and sliding. Event `known` is
    left out.
    """
    event, earliest = -1, 2.0
    for i in range(gaps.shape[1]):
        if i == known:
            continue
        before, after = gaps[0, i], gaps[1, i]
        passed = i < len(records) and records[i, PHASE] == PASSED
        happens = before < 0.0 <= after if passed else before > 0.0 >= after
        if happens and before / (before - after) < earliest:
            event, earliest = i, before / (before - after)
    return event


@compilable
def continuous(model: Any, records: Any, event: int) -> bool:
    """Tells whether the force is continuous at an event: at all of contact surface but the touch.

    At the paper's release and leaving it is so too, but those are located to the last digit.
    """
    i = event % len(records)
    return bool(is_surface(model, i) and records[i, PHASE] != FREE)


@compilable
def _kept(value: float, replaced: float, quick: bool) -> float:
    """What regula falsi keeps of the number at the end that stays twice: a half (Illinois).

    Quick: the share of Anderson and Bjorck (BIT 13:253-264, 1973), which takes fewer steps.
    """
    if quick and 0.0 < value / replaced < 1.0:
        return 1.0 - value / replaced
    return 0.5


@makes_arrays
def integrate(
    model: Any,
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
        y: [q; v; elements; totals] at the start.  records: (contacts, 17) of `laws.phases` at the
            start; (contacts, 32) of `laws.surface` with a contact of that law.
        end: s.  accuracy: of a step in contact, in units of 1 / scale.
        longest: step (s); the length of all steps where they are not controlled.
        scale: (len(y),) weights of errors.
        samples: (n, 1 + len(y)) time and state are written here, at the start and after each step;
            of no rows: nothing is kept.
        sampled: (n, contacts, ...) the records at these times.

    Returns:
        number of samples, steps, evaluations, and how it ended.

    """
    nq, size, contacts = model[at.HEAD][at.POSITIONS], len(y), len(records)
    s = new_work(model, size)
    origin, w, leaves, tau, k = s[0], s[1], s[2], s[3], s[4]
    new, gaps, slopes = np.empty(size), np.ones((2, 2 * contacts)), np.zeros((2, contacts))
    time, count, steps, evaluations = 0.0, 0, 0, 0
    move(model, y, nq, origin, w, leaves)
    for i in range(contacts):
        update(model, i, time, y, records, w, leaves)
    keep = len(samples) > 0
    h = min(longest, FIRST_STEP) if controlled else longest
    fresh, same, slid, before = False, False, 0.0, 1e-4
    while True:
        if keep:
            if count == len(samples):
                return count, steps, evaluations, FULL
            samples[count, 0] = time
            for i in range(size):
                samples[count, 1 + i] = y[i]
            for i in range(contacts):
                for j in range(records.shape[1]):
                    sampled[count, i, j] = records[i, j]
            count += 1
        if time >= end:
            return count, steps, evaluations, FINISHED
        origin[at.CLOCK] = origin[at.STEP_CLOCK] = model[at.GLOBAL][at.BEGIN] + time
        if not fresh:
            rates(model, y, records, origin, w, leaves, tau, k[0])
            evaluations += 1
        stiff = stiff_contact(records)
        allowed = accuracy if touching(records) else OUT_OF_CONTACT * accuracy
        if stiff >= 0:
            split_friction(model, stiff, records, s, nq, slid)
        for i in range(contacts):
            if not same:
                gap, slope, turn = watched(model, i, y, records, w, leaves)
                gaps[1, i], slopes[1, i], gaps[1, contacts + i] = gap, slope, turn
            gaps[0, i], slopes[0, i] = gaps[1, i], slopes[1, i]
            gaps[0, contacts + i] = gaps[1, contacts + i]
        event, searching, side, factor = -1, False, 0, 1.0
        low, high, at_low, at_high, tries, changes = 0.0, 0.0, 0.0, 0.0, 0, 0
        last, refused = time + h >= end - 1e-15, False
        part = end - time if last else h
        while True:  # until the step is good enough, or ends at an event
            take(model, y, part, records, stiff, s, new)
            evaluations += 5 if stiff >= 0 else 6
            for i in range(contacts):
                gap, slope, turn = watched(model, i, new, records, w, leaves)
                gaps[1, i], slopes[1, i], gaps[1, contacts + i] = gap, slope, turn
            if searching:  # regula falsi (Illinois) between low and high
                value = gaps[1, event]
                tries += 1
                share = NEARLY_LOCATED if continuous(model, records, event) else LOCATED
                near = abs(value) <= share * abs(gaps[0, event]) or high - low < SHORTEST
                if near or tries > 60:
                    other = first_event(records, gaps, event)
                    if other < 0 or changes > 2 * contacts:  # two at once do not take turns
                        break
                    changes += 1
                    # another contact's event lies before this one: it is looked for instead
                    event, low, high, side, tries = other, 0.0, part, 0, 0
                    at_low, at_high = gaps[0, event], gaps[1, event]
                    part *= at_low / (at_low - at_high)
                    continue
                quick = is_surface(model, event % contacts)
                if (value > 0.0) == (at_high > 0.0):
                    kept = _kept(value, at_high, quick)
                    high, at_high = part, value
                    at_low *= kept if side == 1 else 1.0
                    side = 1
                else:
                    kept = _kept(value, at_low, quick)
                    low, at_low = part, value
                    at_high *= kept if side == -1 else 1.0
                    side = -1
                part = (low * at_high - high * at_low) / (at_high - at_low)
                continue
            error = _error(part, stiff, records, scale, s, nq)
            shorter = 0.0
            if not math.isfinite(error):
                if part < 1e-9:
                    return count, steps, evaluations, NOT_FINITE
                shorter = 0.25
            elif controlled:
                order = 4.0 if stiff >= 0 else 5.0
                used = error / allowed
                if used > 1.0:
                    if part < SHORTEST:
                        return count, steps, evaluations, STUCK
                    shorter, refused = max(0.2, 0.9 * used ** (-1.0 / order)), True
                else:
                    factor = longer(used, before, order, refused)
                    before = max(used, 1e-4)
            if shorter == 0.0 and part > 1e-9:
                for i in range(contacts):
                    if records[i, PHASE] == FREE and dips(gaps, slopes, i, part):
                        shorter = 0.25
            if shorter > 0.0:
                part *= shorter
                last = False
                continue
            event = first_event(records, gaps, -1)
            if controlled and not (last and event < 0):
                h = min(longest, part * factor)
            if event < 0:
                break
            searching = True
            high, at_low, at_high = part, gaps[0, event], gaps[1, event]
            part *= at_low / (at_low - at_high)
        steps += 1
        time = end if last and event < 0 else time + part
        for i in range(size):
            y[i] = new[i]
        fresh, same = stiff < 0 and event < 0, event < 0
        slid = part if stiff >= 0 and event < 0 else 0.0
        if event < 0:
            for i in range(contacts):
                # a turn between gripping and sliding that no sign told, within a step
                if gaps[1, contacts + i] < 0.0 and update(model, i, time, y, records, w, leaves):
                    fresh = same = False
        if fresh:
            for i in range(size):
                k[0, i] = k[6, i]
        if event >= 0:
            jumps = event < contacts and not continuous(model, records, event)
            pass_event(model, event, time, y, records, w, leaves)
            if controlled and jumps:
                h = min(h, AFTER_EVENT)
