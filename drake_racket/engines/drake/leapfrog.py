"""Brings the samples of a discrete plant to one instant: its velocities are half a step behind.

A discrete plant of step h goes v[n+1] = v[n] + h a(q[n]), q[n+1] = q[n] + h v[n+1]. That is the
leapfrog scheme, of second order, if v[n] is read as the velocity at t[n] - h/2. Energies of q[n]
and v[n] as they stand are off by a whole order, by h/2 times the power of all forces. Half-way to
the next velocities they are those of the instant, and so are the contact's totals, whose step
begins at t[n]:

    v(t[n]) = v[n] + s (v[n+1] - v[n]),   totals likewise,   s = 1/2.

The step at whose beginning the ball is seen to have touched has a force that counts w times (1/2
and what it is late, `phases.late_touch`): there s = (w - 1/2) / w. The first sample is as given.
Losses in dampers are metered with the velocities of a step over that step, which is the midpoint
rule: they stand.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_racket.laws.contact import CONTACT
from drake_racket.laws.phases import PHASE, SEEN, WEIGHT
from drake_racket.laws.totals import LOST_JOINT

Array = NDArray[np.float64]


def shares(record: Array) -> Array:
    """Gives s (n,) of steps that began with the records (n, k)."""
    weight = np.where(record[:, PHASE] == CONTACT, record[:, WEIGHT], 1.0)
    return (weight - 0.5) / weight


def brought_to_time(
    q: Array, v: Array, record: Array, totals: Array, *, given: bool = True
) -> tuple[Array, Array]:
    """Gives velocities and totals of a run's samples at the instants of their positions.

    A Simulator may stop between a plant's steps: such samples have the state, and get the totals,
    of the step's end.

    Args:
        q, v: (m + 1, nq), (m + 1, nv) of the samples, and one step after the last of them.
        record: (m + 1, k) of the contact; one step's is that of the sample at its end.
        totals: (m + 1, t) integrated so far.
        given: the first sample has velocities of its instant.

    Returns:
        Velocities (m, nv), totals (m, t).

    """
    ends = np.append(np.flatnonzero(np.any(q[1:] != q[:-1], axis=1)), len(q) - 1)
    step = np.searchsorted(ends, np.arange(len(q) - 1))  # number of the state that a sample has
    v, totals, s = v[ends], totals[ends].copy(), shares(record[ends[1:]])[:, None]
    if given or np.isnan(record[0, SEEN]):
        s[0] = 0.0
    there = v[:-1] + s * np.diff(v, axis=0)
    totals[:-1, :LOST_JOINT] += s * np.diff(totals[:, :LOST_JOINT], axis=0)
    return there[step], totals[step]
