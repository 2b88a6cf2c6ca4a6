"""What one impact costs in a limb, against the racket without one and the limb's plant alone.

    python benchmarks/limb_impact.py

A 50 ms impact of the shipped limb's one-handed backhand (data/backhand.yaml) with each kind of
grip, and of the free racket, in turns in one run: steps and evaluations of the integrator, and wall
time without audit and histories. Then one evaluation of the whole Diagram's derivatives against
that of its plant alone, in the same state, with forces fixed to zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
from measure import interleaved, table, versions

from drake_racket.cases.case import load_scenario, resolve
from drake_racket.cases.diagram import ImpactDiagram, make_impact_diagram
from drake_racket.engines.drake.engine import run_drake
from drake_racket.io.shipped import data_directory
from drake_racket.parameters.scenario import Scenario

REPEATS = 5
EVALUATIONS = 200


def cases() -> dict[str, Scenario]:
    """Name -> scenario; the ball meets the racket at the same relative speed in all of them."""
    backhand = replace(load_scenario(data_directory() / "backhand.yaml"), audit=False, after=0.05)
    held = {
        f"limb, {kind}": replace(backhand, grip_kind=kind)
        for kind in ("weld", "torsional", "compliant")
    }
    return {"free": Scenario(audit=False, after=0.05), **held}


def evaluation(
    system: Any, root: Any, plant: Any, context: Any, states: Any
) -> Callable[[], float]:
    """EVALUATIONS time derivatives at states that differ, less the time of writing them."""

    def timed() -> float:
        start = perf_counter()
        for state in states:
            plant.SetPositionsAndVelocities(context, state)
            system.EvalTimeDerivatives(root)
        whole = perf_counter() - start
        start = perf_counter()
        for state in states:
            plant.SetPositionsAndVelocities(context, state)
        return (whole - (perf_counter() - start)) / len(states)

    return timed


def evaluations(system: ImpactDiagram) -> dict[str, Callable[[], float]]:
    """Of the Diagram before touch, and of its plant in a Context of its own."""
    root = system.create_context()
    state = system.plant.GetPositionsAndVelocities(system.plant.GetMyContextFromRoot(root)).copy()
    states = state + 1e-9 * np.random.default_rng(0).standard_normal((EVALUATIONS, len(state)))
    alone = system.plant.CreateDefaultContext()
    forces = np.zeros(system.plant.num_velocities())
    system.plant.get_applied_generalized_force_input_port().FixValue(alone, forces)
    plant = system.plant
    inside = plant.GetMyMutableContextFromRoot(root)
    return {
        "diagram": evaluation(system.diagram, root, plant, inside, states),
        "plant alone": evaluation(plant, alone, plant, alone, states),
    }


def main() -> None:
    """Runs and prints the tables."""
    print(versions())
    systems = {name: make_impact_diagram(scenario) for name, scenario in cases().items()}
    runs = {name: run_drake(resolve(scenario), systems[name]) for name, scenario in cases().items()}
    calls = {
        name: (lambda s=scenario, d=systems[name]: run_drake(s, d))
        for name, scenario in cases().items()
    }
    seconds = interleaved(calls, REPEATS)
    free = np.median(seconds["free"])
    rows = [
        (
            name,
            f"{systems[name].plant.num_velocities()}",
            f"{runs[name].steps}",
            f"{runs[name].evaluations}",
            f"{1e3 * np.median(seconds[name]):.0f}",
            f"{np.median(seconds[name]) / free:.2f}",
        )
        for name in runs
    ]
    print(table(("50 ms impact", "velocities", "steps", "evaluations", "ms", "over free"), rows))
    timed = {
        f"{name}: {part}": call
        for name, system in systems.items()
        for part, call in evaluations(system).items()
    }
    each = {name: np.median(values) for name, values in interleaved(timed, REPEATS).items()}
    rows = [
        (
            name,
            f"{1e6 * each[f'{name}: diagram']:.1f}",
            f"{1e6 * each[f'{name}: plant alone']:.1f}",
            f"{each[f'{name}: diagram'] / each[f'{name}: plant alone']:.2f}",
        )
        for name in systems
    ]
    print(table(("one evaluation, before touch", "diagram us", "plant us", "ratio"), rows))


if __name__ == "__main__":
    main()
