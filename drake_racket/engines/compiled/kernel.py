"""Compiles the engine's entry points: one integration, observation of states, one evaluation.

numba's cache on disk knows the file of a compiled function only: the entry points close over the
stamp of all sources that they call, so that an edit anywhere compiles them anew.
"""

from __future__ import annotations

from drake_racket.engines.compiled import integrate, steps
from drake_racket.engines.compiled.dynamics import (
    bed,
    events,
    forces,
    friction,
    layout,
    motion,
    observe,
    rates,
    solve,
    surface,
)
from drake_racket.laws import contact, limits, phases, places, strings, totals
from drake_racket.laws import surface as surface_law
from drake_racket.laws.compilation import sources_stamp, stamped

SOURCES = (
    integrate,
    steps,
    bed,
    events,
    forces,
    friction,
    layout,
    motion,
    observe,
    rates,
    solve,
    surface,
    surface_law,
    places,
    contact,
    limits,
    phases,
    strings,
    totals,
)
"""Modules that decide the numbers of a run."""


_STAMP = sources_stamp(*SOURCES)
run_case = stamped(integrate.integrate, _STAMP, nogil=True)
see_motion = stamped(observe.observe_motion, _STAMP, nogil=True)
see_contact = stamped(observe.observe_contact, _STAMP, nogil=True)
evaluate = stamped(rates.rates, _STAMP, nogil=True)
