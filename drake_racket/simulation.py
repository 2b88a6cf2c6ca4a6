"""Simulates one impact: resolve the case, run an engine, read the results."""

from __future__ import annotations

import os
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from drake_racket.cases.case import Case, resolve, with_engine
from drake_racket.cases.diagram import ImpactDiagram, make_impact_diagram
from drake_racket.derivatives import Parameter, parameters_of, run_with_derivatives
from drake_racket.engines.registry import run
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Report
from drake_racket.parameters.scenario import Scenario
from drake_racket.results.impact import ImpactResult, make_result


def simulate(
    scenario: Scenario | Case | None = None,
    system: ImpactDiagram | None = None,
    *,
    history: bool = True,
    engine: str | None = None,
    derivatives: Sequence[str] | None = None,
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
        derivatives: keys of the scenario or of parameters, as a sweep names them: the result has
            the exact derivatives of its numbers by them (`ImpactResult.derivatives`). The compiled
            engine runs the case then.
        progress: called as a run in Drake's engine goes on; `done` and `total` are its
            milliseconds.

    Raises:
        InputError: the scenario is not valid or needs another Diagram.
        SimulationError: the run could not be finished.

    """
    case = resolve(scenario or Scenario())
    if engine is not None:
        case = with_engine(case, engine)
    parameters = None
    if derivatives is not None:
        if case.scenario.engine == "drake":
            raise InputError("engine", "drake, with derivatives", "auto or compiled")
        parameters = parameters_of(case, derivatives)
    if system is not None:
        return _simulated(case, system, parameters, history, progress)
    with using_diagram(case) as system:
        return _simulated(case, system, parameters, history, progress)


@contextmanager
def using_diagram(case: Case) -> Iterator[ImpactDiagram]:
    """Lends a Diagram for a case: one of an earlier call with its topology, or a new one."""
    system = _taken(case)
    try:
        yield system
    finally:
        _keep(case, system)


def _simulated(
    case: Case,
    system: ImpactDiagram,
    parameters: Sequence[Parameter] | None,
    history: bool,
    progress: Report | None,
) -> ImpactResult:
    if parameters is not None:
        return run_with_derivatives(case, system, parameters, history=history)[0]
    trajectory = run(case, system, every_sample=history, progress=progress)
    return make_result(case, trajectory, history=history)


_MOST_KEPT = 4
_kept: OrderedDict[tuple[Any, ...], ImpactDiagram] = OrderedDict()
"""The Diagrams of the last calls, by topology: on Drake 1.51 what is built is never freed."""


def _taken(case: Case) -> ImpactDiagram:
    """A Diagram for the case, of an earlier call or new; nobody else has it until it is kept."""
    system = _kept.pop(_key(case), None)
    return make_impact_diagram(case) if system is None else system


def _keep(case: Case, system: ImpactDiagram) -> None:
    """Keeps a Diagram for later calls; not that of a limb's file, which may change."""
    if case.limb_hash:
        return
    _kept[_key(case)] = system
    while len(_kept) > _MOST_KEPT:
        _kept.popitem(last=False)


def _key(case: Case) -> tuple[Any, ...]:
    return (os.getpid(), case.topology)  # a forked process builds its own
