"""Compiles the engine's entry points: one integration, observation of states, one evaluation.

numba's cache on disk knows the file of a compiled function only: its entry points close over the
stamp of all sources that they call, so that an edit anywhere compiles them anew.
"""

from __future__ import annotations

from typing import Any

from drake_racket.engines.compiled import integrate, steps
from drake_racket.engines.compiled.dynamics import (
    events,
    forces,
    friction,
    layout,
    motion,
    observe,
    rates,
    solve,
)
from drake_racket.laws import contact, limits, phases, strings, totals
from drake_racket.laws.compilation import compiled, sources_stamp

_SOURCES = (
    events,
    forces,
    friction,
    integrate,
    layout,
    motion,
    observe,
    rates,
    solve,
    steps,
    contact,
    limits,
    phases,
    strings,
    totals,
)


def _entries(stamp: int) -> tuple[Any, Any, Any, Any]:
    def run(
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
        assert stamp
        return integrate.integrate(
            ints,
            floats,
            y,
            records,
            end,
            accuracy,
            longest,
            controlled,
            scale,
            samples,
            sampled,
        )

    def see_motion(
        ints: Any, floats: Any, states: Any, records: Any, nodes: Any, leaves: Any, loads: Any
    ) -> None:
        assert stamp
        observe.observe_motion(ints, floats, states, records, nodes, leaves, loads)

    def see_contact(ints: Any, floats: Any, states: Any, records: Any, out: Any) -> None:
        assert stamp
        observe.observe_contact(ints, floats, states, records, out)

    def evaluate(
        ints: Any,
        floats: Any,
        y: Any,
        records: Any,
        origin: Any,
        w: Any,
        leaves: Any,
        tau: Any,
        f: Any,
    ) -> None:
        assert stamp
        model = layout.open_model(ints, floats)
        rates.rates(ints, floats, model, y, records, origin, w, leaves, tau, f)

    return run, see_motion, see_contact, evaluate


_run, _see_motion, _see_contact, _evaluate = _entries(sources_stamp(*_SOURCES))

run_case = compiled(_run, nogil=True)
"""`integrate.integrate`, compiled."""
see_motion = compiled(_see_motion, nogil=True)
"""`observe.observe_motion`, compiled."""
see_contact = compiled(_see_contact, nogil=True)
"""`observe.observe_contact`, compiled."""
evaluate = compiled(_evaluate, nogil=True)
"""`rates.rates`, compiled, from the two vectors of a model."""
