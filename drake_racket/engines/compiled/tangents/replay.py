"""Follows a finished run again, with the derivatives of its state beside it.

Each step is taken as the run took it, by the tangent of the same code: what comes out is the
derivative of the numerical path. Where a step ends at an event, its length h depends on the
parameters. With g the watched number that is zero there, and dy and dg the derivatives at a held
length,

    dh = -dg / (dg/dh),    dt + dh,    dy + (dy/dh) dh

with dy/dh and dg/dh those of the step itself. (The rates at its end would do for an exact path; but
friction dies away within the last step, and they know nothing of that.) From there on the samples'
times move by dt: after an event the run starts anew, with steps as long as before. At the end of
the run the last step's length makes up for it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.engines.compiled.dynamics.events import watched as watched_only
from drake_racket.engines.compiled.dynamics.rates import move as move_only
from drake_racket.engines.compiled.integrate import new_work, stiff_contact
from drake_racket.engines.compiled.steps import DP_ERROR
from drake_racket.engines.compiled.tangents.lanes import LANES, load, store, zero
from drake_racket.engines.compiled.tangents.twins import (
    move,
    pass_event,
    rates_of,
    split_friction,
    take,
    update,
    watched,
)
from drake_racket.laws.compilation import compilable, makes_arrays
from drake_racket.laws.contact import CONTACT
from drake_racket.laws.phases import PHASE

LOCATED = 1e-6
"""Share of what it was before the step, below which a number is zero at its end."""


@makes_arrays
def _lanes_of(array: Any) -> Any:
    """Lanes of 0 beside an array of two axes."""
    return np.zeros((array.shape[0], array.shape[1], LANES))


@makes_arrays
def _new_lanes(s: Any) -> Any:
    """Lanes beside the work arrays of a run."""
    return (
        np.zeros((len(s[0]), LANES)),
        _lanes_of(s[1]),
        _lanes_of(s[2]),
        np.zeros((len(s[3]), LANES)),
        _lanes_of(s[4]),
        _lanes_of(s[5]),
        _lanes_of(s[6]),
        np.zeros((len(s[7]), LANES)),
        _lanes_of(s[8]),
        _lanes_of(s[9]),
        np.zeros((len(s[10]), LANES)),
    )


@compilable
def changed_contact(before: Any, after: Any) -> int:
    """The event that has changed a record, as `events.pass_event` numbers them; -1: none."""
    for i in range(len(before)):
        for j in range(before.shape[1]):
            a, b = before[i, j], after[i, j]
            if a != b and not (np.isnan(a) and np.isnan(b)):
                # the phase stays where a contact surface turns between gripping and sliding
                same = before[i, PHASE] == CONTACT and after[i, PHASE] == CONTACT
                return i + len(before) if same else i
    return -1


@makes_arrays
def _by_length(
    model: Any, still: Any, y: Any, h: float, records: Any, stiff: int, s: Any, longer: Any
) -> None:
    """Writes the derivative of a step's end by its length into lane 0 of `longer`."""
    d_s, held = _new_lanes(s), np.zeros((len(records), records.shape[1], LANES))
    one, new, d_y = np.zeros((1, LANES)), np.empty(len(y)), np.zeros((len(y), LANES))
    one[0, 0] = 1.0
    take(model, still, y, d_y, h, load(one, 0), records, held, stiff, s, d_s, new, longer)


@compilable
def _number(found: Any, turning: bool) -> Any:
    """Of what `watched` gives: the number that is zero at an event."""
    return found[2] if turning else found[0]


@makes_arrays
def _pass(
    model: Any,
    d_model: Any,
    still: Any,
    event: int,
    time: float,
    y: Any,
    d_y: Any,
    longer: Any,
    records: Any,
    d_records: Any,
    s: Any,
    d_s: Any,
    d_time: Any,
) -> None:
    """Takes state, records and time, and their lanes, through an event.

    Args:
        event: as of `events.pass_event`.
        d_y: of the end of the step, at a held length.  longer: by its length, in lane 0.

    """
    nq = model[at.HEAD][at.POSITIONS]
    i, turning = event % len(records), event >= len(records)
    held = np.zeros((len(records), records.shape[1], LANES))
    move(model, still, y, longer, nq, s[0], d_s[0], s[1], d_s[1], s[2], d_s[2])
    found = watched(model, still, i, y, longer, records, held, s[1], d_s[1], s[2], d_s[2])
    rate = np.zeros((1, LANES))
    store(rate, _number(found[1], turning), 0)
    move(model, d_model, y, d_y, nq, s[0], d_s[0], s[1], d_s[1], s[2], d_s[2])
    found = watched(model, d_model, i, y, d_y, records, d_records, s[1], d_s[1], s[2], d_s[2])
    dh = _number(found[1], turning) * (-1.0 / rate[0, 0])
    for k in range(len(y)):
        store(d_y, load(d_y, k) + dh * longer[k, 0], k)
    dt = load(d_time, 0) + dh
    store(d_time, dt, 0)
    move(model, d_model, y, d_y, nq, s[0], d_s[0], s[1], d_s[1], s[2], d_s[2])
    pass_event(
        model, d_model, event, time, dt, y, d_y, records, d_records, s[1], d_s[1], s[2], d_s[2]
    )


@compilable
def _turn_of(model: Any, i: int, y: Any, records: Any, s: Any) -> float:
    """The number that is zero where contact i turns from gripping to sliding or back."""
    move_only(model, y, model[at.HEAD][at.POSITIONS], s[0], s[1], s[2])
    turn: float = watched_only(model, i, y, records, s[1], s[2])[2]
    return turn


@makes_arrays
def replay(
    model: Any,
    d_model: Any,
    still: Any,
    samples: Any,
    sampled: Any,
    blank: Any,
    d_y: Any,
    d_end: Any,
    scale: Any,
    states: Any,
    records_out: Any,
    times: Any,
) -> float:
    """Writes the lanes of a run at all its samples.

    The run's steps are as short as its own errors ask for. A motion that the run does not have, but
    its derivative does, may need shorter ones: the largest error of a step, as a share of the
    derivative, is returned.

    Args:
        model, d_model: tables, and their lanes; of tables of integers these themselves.
        still: such lanes of 0.
        samples, sampled: of the run: (n, 1 + size) time and state, (n, contacts, 17) records.
        blank: (contacts, 17) records before the run.
        d_y: (size, LANES) of the state at the start; changed.
        d_end: (1, LANES) of the time when the run ends.
        scale: (size,) weights of errors, of the run.
        states: (n, size, LANES) of the states, at the times of the samples, which may depend on
            the parameters: `times` (n, LANES).
        records_out: (n, contacts, 17, LANES) of the records.

    """
    nq, size = model[at.HEAD][at.POSITIONS], samples.shape[1] - 1
    s = new_work(model, size)
    d_s = _new_lanes(s)
    y, new, d_new = samples[0, 1:].copy(), np.empty(size), np.zeros((size, LANES))
    records, d_records = blank.copy(), _lanes_of(blank)
    d_time, longer = np.zeros((1, LANES)), np.zeros((size, LANES))
    move(model, d_model, y, d_y, nq, s[0], d_s[0], s[1], d_s[1], s[2], d_s[2])
    for i in range(len(records)):
        update(
            model, d_model, i, 0.0, zero(), y, d_y, records, d_records, s[1], d_s[1], s[2], d_s[2]
        )
    slid, last = 0.0, len(samples) - 1
    sizes, worst = np.zeros(LANES), 0.0
    for n in range(last + 1):
        for k in range(size):
            store(states, load(d_y, k), n, k)
        for i in range(len(records)):
            for j in range(records.shape[1]):
                store(records_out, load(d_records, i, j), n, i, j)
        store(times, load(d_time, 0), n)
        if n == last:
            break
        rates_of(
            model, d_model, y, d_y, records, d_records, s[0], d_s[0], s[1], d_s[1], s[2], d_s[2],
            s[3], d_s[3], s[4][0], d_s[4][0],
        )  # fmt: skip
        part = samples[n + 1, 0] - samples[n, 0]
        stiff = stiff_contact(records)
        if stiff >= 0:
            split_friction(model, d_model, stiff, records, d_records, s, d_s, nq, slid)
        take(model, d_model, y, d_y, part, zero(), records, d_records, stiff, s, d_s, new, d_new)
        if stiff < 0:
            worst = max(worst, _share_of_error(part, d_s[4], d_new, scale, sizes))
        event = changed_contact(sampled[n], sampled[n + 1])
        unseen = False
        if event >= len(records):
            # a turn between gripping and sliding: located, or found at the end of a step
            i = event - len(records)
            before = _turn_of(model, i, y, records, s)
            after = _turn_of(model, i, new, records, s)
            unseen = not abs(after) <= LOCATED * abs(before)
        slid = part if stiff >= 0 and event < 0 else 0.0
        if event >= 0 or n + 1 == last:
            _by_length(model, still, y, part, records, stiff, s, longer)
        for k in range(size):
            y[k] = samples[n + 1, 1 + k]
            store(d_y, load(d_new, k), k)
        if unseen:
            move(model, d_model, y, d_y, nq, s[0], d_s[0], s[1], d_s[1], s[2], d_s[2])
            update(
                model, d_model, event - len(records), samples[n + 1, 0], load(d_time, 0), y, d_y,
                records, d_records, s[1], d_s[1], s[2], d_s[2],
            )  # fmt: skip
        elif event >= 0:
            _pass(
                model, d_model, still, event, samples[n + 1, 0], y, d_y, longer, records,
                d_records, s, d_s, d_time,
            )  # fmt: skip
    for k in range(size):
        moved = (load(d_end, 0) - load(d_time, 0)) * longer[k, 0]
        store(states, load(states, last, k) + moved, last, k)
    store(times, load(d_end, 0), last)
    return worst


@compilable
def _share_of_error(h: float, d_k: Any, d_new: Any, scale: Any, sizes: Any) -> float:
    """Largest error of a step out of contact, as a share of the largest derivative so far.

    That one is kept in `sizes`, by lanes.
    """
    share = 0.0
    for lane in range(LANES):
        error, size = 0.0, 0.0
        for i in range(len(scale)):
            total = 0.0
            for j in range(7):
                total += DP_ERROR[j] * d_k[j, i, lane]
            error += (h * total * scale[i]) ** 2
            size += (d_new[i, lane] * scale[i]) ** 2
        sizes[lane] = max(sizes[lane], np.sqrt(size))
        if sizes[lane] > 0.0:
            share = max(share, np.sqrt(error) / sizes[lane])
    return share
