"""Simulates one impact: resolve the case, run an engine, read the results."""

from __future__ import annotations

import os
from collections import OrderedDict
from typing import Any

from drake_racket.cases.case import Case, changed, resolve
from drake_racket.cases.diagram import ImpactDiagram, make_impact_diagram
from drake_racket.engines.registry import run
from drake_racket.io.progress import Report
from drake_racket.parameters.scenario import Scenario
from drake_racket.results.impact import ImpactResult, make_result


def simulate(
    scenario: Scenario | Case | None = None,
    system: ImpactDiagram | None = None,
    *,
    history: bool = True,
    engine: str | None = None,
    progress: Report | None = None,
) -> ImpactResult:
    """Simulates one impact.

    Args:
        scenario: the case (the default: tour racket, free, centre, 25 m/s).
        system: a Diagram from `make_impact_diagram` to use again. It must have the scenario's
            topology. None: one of an earlier call with that topology, or a new one.
        history: record motion and energies at every step; without it `ImpactResult.history` and
            what is read from it are None, and the balance is that of the end alone.
        engine: `drake` or `compiled`, in place of the scenario's.
        progress: called as a run in Drake's engine goes on; `done` and `total` are its
            milliseconds.

    Raises:
        InputError: the scenario is not valid or needs another Diagram.
        SimulationError: the run could not be finished.

    """
    case = resolve(scenario or Scenario())
    if engine is not None:
        case = resolve(changed(case.scenario, engine=engine))
    system = system or _kept(case)
    trajectory = run(case, system, every_sample=history, progress=progress)
    return make_result(case, trajectory, history=history)


_MOST_KEPT = 4
_systems: OrderedDict[tuple[Any, ...], ImpactDiagram] = OrderedDict()
"""The Diagrams of the last calls, by topology: on Drake 1.51 what is built is never freed."""


def _kept(case: Case) -> ImpactDiagram:
    """A Diagram for the case; one of an earlier call, but of a limb's file, which may change."""
    if case.limb_hash:
        return make_impact_diagram(case)
    key = (os.getpid(), case.topology)  # a forked process builds its own
    if key not in _systems:
        _systems[key] = make_impact_diagram(case)
    _systems.move_to_end(key)
    while len(_systems) > _MOST_KEPT:
        _systems.popitem(last=False)
    return _systems[key]
