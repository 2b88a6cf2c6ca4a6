"""Follows a finished run again, with the derivatives of its state beside it.

Each step is taken as the run took it, by the tangent of the same code: what comes out is the
derivative of the numerical path, step lengths held. At an event the time depends on the parameters
too. With g the watched number that is zero there, s = dy the tangent of the state at a fixed time,
and f- and f+ the rates before and after,

    dt = -dg / g',    s at the event = s + f- dt,    s after it = s at the event - f+ dt

(the jump rule, e.g. of Hiskens and Pai, IEEE Trans. Circuits Syst. I 47:204-220, 2000).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.engines.compiled.integrate import new_work, stiff_contact
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
from drake_racket.laws.compilation import compilable


@compilable
def _lanes_of(array: Any) -> Any:
    """Lanes of 0 beside an array of two axes."""
    return np.zeros((array.shape[0], array.shape[1], LANES))


@compilable
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
    """The contact whose record an event has changed; -1: none."""
    for i in range(len(before)):
        for j in range(before.shape[1]):
            a, b = before[i, j], after[i, j]
            if a != b and not (np.isnan(a) and np.isnan(b)):
                return i
    return -1


@compilable
def _pass(
    model: Any,
    d_model: Any,
    still: Any,
    i: int,
    time: float,
    y: Any,
    d_y: Any,
    records: Any,
    d_records: Any,
    s: Any,
    d_s: Any,
    d_time: Any,
) -> None:
    """Takes state and record of contact i, and their lanes, through an event; writes its dt."""
    nq = model[at.HEAD][at.POSITIONS]
    f, d_f = s[4][0], d_s[4][0]
    rates_of(
        model, d_model, y, d_y, records, d_records, s[0], d_s[0], s[1], d_s[1], s[2], d_s[2],
        s[3], d_s[3], f, d_f,
    )  # fmt: skip
    d_g = watched(model, d_model, i, records, d_records, s[1], d_s[1], s[2], d_s[2])[1][0]
    # how fast the watched number changes: its lanes along the motion, all parameters held
    along, held = np.zeros((len(y), LANES)), np.zeros((len(records), records.shape[1], LANES))
    for k in range(len(y)):
        along[k, 0] = f[k]
    move(model, still, y, along, nq, s[0], d_s[0], s[1], d_s[1], s[2], d_s[2])
    d_rate = watched(model, still, i, records, held, s[1], d_s[1], s[2], d_s[2])[1][0]
    rate = np.zeros((1, LANES))
    store(rate, d_rate, 0)
    dt = d_g * (-1.0 / rate[0, 0])
    store(d_time, dt, 0)
    for k in range(len(y)):
        store(d_y, load(d_y, k) + dt * f[k], k)
    move(model, d_model, y, d_y, nq, s[0], d_s[0], s[1], d_s[1], s[2], d_s[2])
    pass_event(model, d_model, i, time, dt, records, d_records, s[1], d_s[1], s[2], d_s[2])


@compilable
def replay(
    model: Any,
    d_model: Any,
    still: Any,
    samples: Any,
    sampled: Any,
    blank: Any,
    d_y: Any,
    d_end: Any,
    states: Any,
    records_out: Any,
    times: Any,
) -> None:
    """Writes the lanes of a run at all its samples.

    Args:
        model, d_model: tables, and their lanes; of tables of integers these themselves.
        still: such lanes of 0.
        samples, sampled: of the run: (n, 1 + size) time and state, (n, contacts, 15) records.
        blank: (contacts, 15) records before the run.
        d_y: (size, LANES) of the state at the start; changed.
        d_end: (1, LANES) of the time when the run ends.
        states: (n, size, LANES) of the states, at the times of the samples, which may depend on
            the parameters: `times` (n, LANES).
        records_out: (n, contacts, 15, LANES) of the records.

    """
    nq, size = model[at.HEAD][at.POSITIONS], samples.shape[1] - 1
    s = new_work(model, size)
    d_s = _new_lanes(s)
    y, new, d_new = samples[0, 1:].copy(), np.empty(size), np.zeros((size, LANES))
    records, d_records = blank.copy(), _lanes_of(blank)
    d_time = np.zeros((1, LANES))
    move(model, d_model, y, d_y, nq, s[0], d_s[0], s[1], d_s[1], s[2], d_s[2])
    for i in range(len(records)):
        update(model, d_model, i, 0.0, records, d_records, s[1], d_s[1], s[2], d_s[2])
    slid, last = 0.0, len(samples) - 1
    for n in range(last + 1):
        for k in range(size):
            store(states, load(d_y, k), n, k)
        for i in range(len(records)):
            for j in range(records.shape[1]):
                store(records_out, load(d_records, i, j), n, i, j)
        store(times, load(d_time, 0), n)
        # from here on at the time of this sample, held; and the first slope of the next step
        rates_of(
            model, d_model, y, d_y, records, d_records, s[0], d_s[0], s[1], d_s[1], s[2], d_s[2],
            s[3], d_s[3], s[4][0], d_s[4][0],
        )  # fmt: skip
        if n == last:
            break
        if n > 0 and _moved(d_time):
            for k in range(size):
                store(d_y, load(d_y, k) - load(d_time, 0) * s[4][0, k], k)
            rates_of(
                model, d_model, y, d_y, records, d_records, s[0], d_s[0], s[1], d_s[1], s[2],
                d_s[2], s[3], d_s[3], s[4][0], d_s[4][0],
            )  # fmt: skip
        store(d_time, zero(), 0)
        part = samples[n + 1, 0] - samples[n, 0]
        stiff = stiff_contact(records)
        if stiff >= 0:
            split_friction(model, d_model, stiff, records, d_records, s, d_s, nq, slid)
        take(model, d_model, y, d_y, part, records, d_records, stiff, s, d_s, new, d_new)
        for k in range(size):
            y[k] = samples[n + 1, 1 + k]
            store(d_y, load(d_new, k), k)
        event = changed_contact(sampled[n], sampled[n + 1])
        slid = part if stiff >= 0 and event < 0 else 0.0
        if event >= 0:
            time = samples[n + 1, 0]
            _pass(model, d_model, still, event, time, y, d_y, records, d_records, s, d_s, d_time)
    # the end of the run moves too
    store(times, load(d_end, 0), last)
    for k in range(size):
        store(states, load(states, last, k) + load(d_end, 0) * s[4][0, k], last, k)


@compilable
def _moved(d_time: Any) -> bool:
    largest = 0.0
    for k in range(LANES):
        largest = max(largest, abs(d_time[0, k]))
    return largest > 0.0
