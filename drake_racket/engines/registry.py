"""Knows the engines by name, and which one runs a case."""

from __future__ import annotations

from collections.abc import Callable

from drake_racket.cases.case import Case
from drake_racket.cases.diagram import ImpactDiagram
from drake_racket.engines.trajectory import Trajectory
from drake_racket.io.progress import Report

Engine = Callable[..., Trajectory]
"""Runs a case in the Diagram of its topology: `engine(case, system, every_sample=...)`."""


def find_engine(case: Case) -> Engine:
    """Gives the engine that a case names; `auto` is Drake's: see `sweep.worker` for sweeps."""
    if case.scenario.engine == "compiled":
        from drake_racket.engines.compiled.engine import run_compiled

        return run_compiled
    from drake_racket.engines.drake.engine import run_drake

    return run_drake


def run(
    case: Case,
    system: ImpactDiagram,
    *,
    every_sample: bool = True,
    progress: Report | None = None,
) -> Trajectory:
    """Runs one case in its engine.

    Args:
        case: with the topology of `system`.
        system: the Diagram, as often as you like.
        every_sample: record the motion at every sample, or at the first and the last.
        progress: called as a run in Drake's engine goes on; the compiled one takes milliseconds.

    Raises:
        InputError: the case needs another Diagram, or another engine.
        SimulationError: the run could not be finished.

    """
    told = {} if case.scenario.engine == "compiled" else {"progress": progress}
    return find_engine(case)(case, system, every_sample=every_sample, **told)
