"""What a ball that spins costs in the compiled engine, against the paper's ball.

    python benchmarks/surface_cost.py

Twelve default impacts of 50 ms (0 to 60 degrees; free, held, head clamped) with each contact, in
turns in one run: evaluations of the equations, and the median CPU time of an integration.
"""

from __future__ import annotations

from collections.abc import Callable
from time import process_time
from typing import Any

import numpy as np
from measure import interleaved, table, versions

from drake_racket.cases.case import Case, resolve
from drake_racket.cases.diagram import make_impact_diagram
from drake_racket.engines.compiled.engine import CompiledImpact
from drake_racket.laws.surface import CONTACTS
from drake_racket.parameters.scenario import Scenario

REPEATS = 40
SUPPORTS = ("free", "grip", "clamped_head")
INCIDENCES = (0.0, 20.0, 40.0, 60.0)


def integration(engine: CompiledImpact, case: Case) -> Callable[[], float]:
    """CPU seconds of one integration, without reading the case."""
    start = engine.start(case)

    def timed() -> float:
        before = process_time()
        engine.samples(case, start)
        return process_time() - before

    return timed


def row(support: str, incidence: float, engines: dict[Any, CompiledImpact]) -> list[str]:
    """One case with both contacts."""
    calls, evaluations = {}, []
    for contact in CONTACTS:
        case = resolve(Scenario(contact=contact, support=support, incidence_deg=incidence))
        if case.topology not in engines:
            engines[case.topology] = CompiledImpact(make_impact_diagram(case))
        engine = engines[case.topology]
        evaluations.append(engine.samples(case, engine.start(case)).evaluations)
        calls[contact] = integration(engine, case)
    taken = {name: float(np.median(s)) for name, s in interleaved(calls, REPEATS).items()}
    return [
        f"{support}, {incidence:g} degrees",
        *(f"{n}" for n in evaluations),
        f"{evaluations[1] / evaluations[0]:.3f}",
        *(f"{1e3 * taken[c]:.2f}" for c in CONTACTS),
        f"{taken['surface'] / taken['paper']:.3f}",
    ]


def main() -> None:
    """Prints the table."""
    engines: dict[Any, CompiledImpact] = {}
    rows = [row(support, incidence, engines) for support in SUPPORTS for incidence in INCIDENCES]
    head = ["impact", "evaluations, paper", "surface", "ratio", "ms, paper", "surface", "ratio"]
    print(versions("numba"))
    print(table(head, rows))


if __name__ == "__main__":
    main()
