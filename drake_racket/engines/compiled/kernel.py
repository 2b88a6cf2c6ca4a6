"""Compiles the engine's entry points: one integration, observation of states, one evaluation.

numba's cache on disk knows the file of a compiled function only: the entry points close over the
stamp of all sources that they call, so that an edit anywhere compiles them anew.
"""

from __future__ import annotations

import types
from collections.abc import Callable
from typing import Any

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
from drake_racket.laws.compilation import compiled, sources_stamp

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


def entry(law: Callable[..., Any], stamp: int) -> Callable[..., Any]:
    """Compiles a copy of `law` that has the stamp among what it closes over."""
    code = law.__code__.replace(co_freevars=(*law.__code__.co_freevars, "stamp"))
    cell = types.CellType(stamp)
    copy = types.FunctionType(
        code, law.__globals__, law.__name__, law.__defaults__, (*(law.__closure__ or ()), cell)
    )
    copy.__qualname__ = law.__qualname__
    return compiled(copy, nogil=True)


_STAMP = sources_stamp(*SOURCES)
run_case = entry(integrate.integrate, _STAMP)
see_motion = entry(observe.observe_motion, _STAMP)
see_contact = entry(observe.observe_contact, _STAMP)
evaluate = entry(rates.rates, _STAMP)
