"""Computes the derivatives of a compiled run's path along any number of directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.engines.compiled.tangents.kernel import run_tangents
from drake_racket.engines.compiled.tangents.lanes import LANES

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Directions:
    """Directions say how the start of a run depends on parameters (p of them).

    Attributes:
        floats: (p, floats) derivatives of the model's numbers.
        y: (p, size) of the state at the start.  end: (p,) of the time when the run ends.

    """

    floats: Array
    y: Array
    end: Array


@dataclass(frozen=True)
class Tangents:
    """Tangents say how a run's samples depend on the parameters.

    Attributes:
        error: largest error of a step as a share of the derivative; out of contact.
        time: (p, n) of the times; those of events move.
        state: (p, n, size) of the states at these times.
        record: (p, n, contacts, 17) of what the contacts have latched.

    """

    error: float
    time: Array
    state: Array
    record: Array


def tangents_of(
    ints: NDArray[np.int64],
    floats: Array,
    samples: Array,
    sampled: Array,
    blank: Array,
    scale: Array,
    directions: Directions,
) -> Tangents:
    """Gives the derivatives of a run's path; several directions share one pass.

    Args:
        ints, floats: of the model.  samples, sampled: what the run kept, at every step.
        blank: records before the run.  scale: weights of errors, of the run.

    """
    count, n, size = len(directions.end), len(samples), samples.shape[1] - 1
    time = np.zeros((count, n))
    state, record = np.zeros((count, n, size)), np.zeros((count, *sampled.shape))
    error = 0.0
    model, none = at.open_model(ints, floats), np.zeros((len(floats), LANES))
    for first in range(0, count, LANES):
        some = slice(first, min(first + LANES, count))
        states, times = np.zeros((n, size, LANES)), np.zeros((n, LANES))
        records = np.zeros((*sampled.shape, LANES))
        share = run_tangents(
            model,
            at.open_model(ints, _laned(directions.floats[some])),
            at.open_model(ints, none),
            samples,
            sampled,
            blank,
            _laned(directions.y[some]),
            _laned(directions.end[some, None]),
            scale,
            states,
            records,
            times,
        )
        error = max(error, share)
        kept = some.stop - first
        time[some] = times.T[:kept]
        state[some] = np.moveaxis(states, -1, 0)[:kept]
        record[some] = np.moveaxis(records, -1, 0)[:kept]
    return Tangents(error, time, state, record)


def _laned(rows: Array) -> Array:
    """Directions as last axis, filled up to LANES with zeros."""
    wide = np.zeros((rows.shape[1], LANES))
    wide[:, : len(rows)] = rows.T
    return wide
