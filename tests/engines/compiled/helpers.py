"""Evaluates the compiled engine's equations at a state, as plain Python or in machine code."""

from __future__ import annotations

import numpy as np

from drake_racket.engines.compiled.dynamics import layout
from drake_racket.engines.compiled.kernel import evaluate
from drake_racket.laws.phases import SIZE


def rates_at(model, floats, state, records=None):
    """Rates of [q; v; totals] at a state; `records` (contacts, 15)."""
    ints = model.ints
    if records is None:
        records = np.zeros((ints[layout.CONTACTS], SIZE))
    work = layout.work_of(ints)
    out = np.zeros(len(state))
    tau = np.zeros(ints[layout.VELOCITIES])
    tables = layout.open_model(ints, floats)
    evaluate(tables, np.array(state), records, np.zeros(layout.ORIGIN_WORK), *work, tau, out)
    return out
