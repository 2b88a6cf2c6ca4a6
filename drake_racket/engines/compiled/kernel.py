"""Compiles the engine's entry points: one integration, observation of states, one evaluation.

numba's cache on disk knows the file of a compiled function only: the entry points close over the
stamp of all sources that they call, so that an edit anywhere compiles them anew.
"""

from __future__ import annotations

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
from drake_racket.laws import contact, limits, phases, places, pulse, strings, totals
from drake_racket.laws import surface as surface_law
from drake_racket.laws.compilation import sources_stamp, stamped, without_collecting

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
    pulse,
    strings,
    totals,
)
"""Modules that decide the numbers of a run."""


class Entry:
    """An entry point is a function that is compiled, or read from the cache, when first called."""

    def __init__(self, machine_code: Callable[..., Any]) -> None:
        """Keeps the function for compiled callers: `machine_code`."""
        self.machine_code = machine_code
        self._is_ready = False

    def __call__(self, *arguments: Any) -> Any:
        """Calls it; other threads may run meanwhile."""
        if self._is_ready:
            return self.machine_code(*arguments)
        with without_collecting():
            result = self.machine_code(*arguments)
        self._is_ready = True
        return result


def entry(law: Callable[..., Any], stamp: int) -> Entry:
    """Compiles a copy of `law` that has the stamp among what it closes over, when first called."""
    return Entry(stamped(law, stamp, nogil=True))


_STAMP = sources_stamp(*SOURCES)
run_case = entry(integrate.integrate, _STAMP)
see_motion = entry(observe.observe_motion, _STAMP)
see_contact = entry(observe.observe_contact, _STAMP)
evaluate = entry(rates.rates, _STAMP)
