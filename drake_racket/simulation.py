"""Simulates one impact: resolve the case, run an engine, read the results."""

from __future__ import annotations

from drake_racket.cases.case import Case, resolve, with_engine
from drake_racket.cases.diagram import ImpactDiagram, make_impact_diagram
from drake_racket.engines.registry import run
from drake_racket.parameters.scenario import Scenario
from drake_racket.results.impact import ImpactResult, make_result


def simulate(
    scenario: Scenario | Case | None = None,
    system: ImpactDiagram | None = None,
    *,
    history: bool = True,
    engine: str | None = None,
) -> ImpactResult:
    """Simulates one impact.

    Args:
        scenario: the case (the default: tour racket, free, centre, 25 m/s).
        system: a Diagram from `make_impact_diagram` to use again; built if None. It must have the
            scenario's topology.
        history: record motion and energies at every step; without it `ImpactResult.history` and
            what is read from it are None, and the balance is that of the end alone.
        engine: `drake` or `compiled`, in place of the scenario's.

    Raises:
        InputError: the scenario is not valid or needs another Diagram.
        SimulationError: the run could not be finished.

    """
    case = resolve(scenario or Scenario())
    if engine is not None:
        case = with_engine(case, engine)
    system = system or make_impact_diagram(case)
    return make_result(case, run(case, system, every_sample=history), history=history)
