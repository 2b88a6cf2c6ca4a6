"""What one evaluation of the time derivatives costs, against the plant alone.

    python benchmarks/evaluation_cost.py

The same evaluation on a ladder of systems around the same plant (tour racket, free, one ball):

    plant         the MultibodyPlant alone in its own Context, its forces fixed to zero
    + systems     a Diagram with plant, StringBed and BallContact, their forces not wired
    + StringBed   its generalized forces wired
    + BallContact `make_impact_diagram` with audit=False: the ready-made case
    + EnergyMeter `make_impact_diagram` with audit=True, the default

so that the difference of two rungs is what one part adds. "Free" is the ball 25 mm in front of the
strings; "contact" is the ball 2 mm past the centre string mass, with the contact latched. The state
is written before each evaluation and never the same twice, so that nothing is answered from cache;
the time of the writing is measured and taken off. All rungs and both phases are measured in turns
in one run.

A default impact is then run with a monitor that counts the integrator's evaluations in each phase
(to one step at touch and release). They weight the mean, which is held against the wall time of the
same run per evaluation: that also has the witnesses, the isolation of touch and release, and the
integrator's own work.

Everything is measured with numba and, in a process where it cannot be imported, without.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import numpy as np
import typer
from measure import interleaved, table, versions
from numpy.typing import NDArray
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, EventStatus

from drake_racket.cases.diagram import make_impact_diagram
from drake_racket.engines.drake.engine import configure_integrator
from drake_racket.laws.contact import CONTACT
from drake_racket.parameters.scenario import Scenario
from drake_racket.plant.ball import add_ball
from drake_racket.plant.compose import add_impact
from drake_racket.plant.supports import add_supported_racket

RUNGS = ("plant", "+ systems", "+ StringBed", "+ BallContact", "+ EnergyMeter")
PHASES = ("free", "contact")
EVALUATIONS = 100  # in one timed call
RUNS = 9  # of the default impact
TARGET = 1.8  # times the plant alone


def ladder(phase: str) -> dict[str, tuple[Any, Any]]:
    """Each rung's system and a root Context that is in `phase`."""
    scenario = Scenario(approach_time=0.001 if phase == "free" else 0.0)
    rungs: dict[str, tuple[Any, Any]] = {}
    for name in RUNGS[:3]:
        plant, system = _partial(scenario, strings=name == "+ StringBed")
        system = plant if name == "plant" else system
        rungs[name] = system, system.CreateDefaultContext()
    plant, _ = rungs["plant"]
    forces = np.zeros(plant.num_velocities())
    plant.get_applied_generalized_force_input_port().FixValue(rungs["plant"][1], forces)
    for name, audit in (("+ BallContact", False), ("+ EnergyMeter", True)):
        ready = make_impact_diagram(replace(scenario, audit=audit))
        simulator = Simulator(ready.diagram, ready.create_context())
        simulator.Initialize()  # latches the contact of a ball that starts at touch
        rungs[name] = ready.diagram, simulator.get_mutable_context().Clone()
    return rungs


def _partial(scenario: Scenario, *, strings: bool) -> tuple[MultibodyPlant, Any]:
    """Plant, StringBed and BallContact in a Diagram, with the strings' forces wired or none."""
    builder = DiagramBuilder()
    plant = builder.AddNamedSystem("plant", MultibodyPlant(0.0))
    racket = add_supported_racket(plant, scenario.load_racket(), scenario.support)
    ball = add_ball(plant, scenario.load_ball())
    plant.mutable_gravity_field().set_gravity_vector(scenario.gravity)
    plant.Finalize()
    impact = add_impact(builder, plant, racket, ball, point=5, connect=False)
    if strings:
        port = plant.get_applied_generalized_force_input_port()
        builder.Connect(impact.generalized_force_port(), port)
    return plant, builder.Build()


def states(phase: str) -> NDArray[np.float64]:
    """(EVALUATIONS, nq + nv) states of the plant around that of the phase."""
    ready = make_impact_diagram(Scenario(approach_time=0.001 if phase == "free" else 0.0))
    root, plant = ready.create_context(), ready.plant
    context = plant.GetMyMutableContextFromRoot(root)
    if phase == "contact":
        ball = ready.impact.ball.body
        pose = plant.GetFreeBodyPose(context, ball)
        pose.set_translation(pose.translation() - [0.0, 0.0, 0.002])
        plant.SetFreeBodyPose(context, ball, pose)
    state = plant.GetPositionsAndVelocities(context)
    noise = np.random.default_rng(0).uniform(-1e-6, 1e-6, (EVALUATIONS, len(state)))
    return state + noise


def evaluations(system: Any, root: Any, plant_states: NDArray[np.float64]) -> Callable[[], None]:
    """Evaluates the derivatives once per state; without a system, only writes the states."""
    meter = root.num_continuous_states() - plant_states.shape[1]
    rows = list(np.pad(plant_states, ((0, 0), (0, meter))))

    def evaluate() -> None:
        for row in rows:
            root.SetContinuousState(row)
            system.EvalTimeDerivatives(root)

    def write() -> None:
        for row in rows:
            root.SetContinuousState(row)

    return write if system is None else evaluate


def measure(repeats: int) -> dict[tuple[str, str], NDArray[np.float64]]:
    """Seconds per evaluation, (repeats,) by phase and rung, without the writing of the state."""
    calls = {}
    for phase in PHASES:
        rungs, rows = ladder(phase), states(phase)
        for name, (system, root) in rungs.items():
            calls[f"{phase}/{name}"] = evaluations(system, root, rows)
        calls[f"{phase}/writing"] = evaluations(None, rungs["+ BallContact"][1], rows)
    seconds = interleaved(calls, repeats)
    return {
        (phase, name): (seconds[f"{phase}/{name}"] - np.median(seconds[f"{phase}/writing"]))
        / EVALUATIONS
        for phase in PHASES
        for name in RUNGS
    }


def default_impact(*, audit: bool) -> tuple[dict[str, int], NDArray[np.float64]]:
    """Evaluations in each phase of a default impact, and wall seconds of each of some runs."""
    ready = make_impact_diagram(Scenario(audit=audit))
    scenario, contact = ready.scenario, ready.impact.contact
    end = scenario.approach_time + scenario.after

    def simulator() -> Simulator:
        made = Simulator(ready.diagram, ready.create_context())
        configure_integrator(made, scenario.integrator)
        made.Initialize()
        return made

    wall = []
    for _ in range(RUNS):
        run = simulator()
        start = perf_counter()
        run.AdvanceTo(end)
        wall.append(perf_counter() - start)

    counts, seen = dict.fromkeys(PHASES, 0), 0
    run = simulator()
    integrator = run.get_integrator()

    def count(root: Any) -> EventStatus:
        nonlocal seen
        now = integrator.get_num_derivative_evaluations()
        phase = contact.GetMyContextFromRoot(root).get_discrete_state_vector()[0]
        counts["contact" if phase == CONTACT else "free"] += now - seen
        seen = now
        return EventStatus.Succeeded()

    run.set_monitor(count)
    run.AdvanceTo(end)
    return counts, np.array(wall)


def report(repeats: int) -> None:
    """Measures and prints."""
    taken = measure(repeats)
    print(f"\n## {versions()}\n\nMicroseconds per evaluation; median of {repeats} (minimum).\n")
    rows = []
    for name in RUNGS:
        row = [name]
        for phase in PHASES:
            seconds, plant = taken[phase, name], taken[phase, "plant"]
            row.append(f"{1e6 * np.median(seconds):.1f} ({1e6 * np.min(seconds):.1f})")
            row.append(f"{np.median(seconds) / np.median(plant):.2f}")
            row.append(f"{np.min(seconds) / np.min(plant):.2f}")
        rows.append(row)
    columns = [f"{phase}{what}" for phase in PHASES for what in (", us", ", / plant", ", of min")]
    print(table(["system", *columns], rows))
    print("\nWhat each part adds (us, difference of medians):\n")
    parts = ["Diagram and calls into Python", "StringBed", "BallContact", "EnergyMeter"]
    steps = {p: np.diff([np.median(taken[p, r]) for r in RUNGS]) * 1e6 for p in PHASES}
    rows = [[part, *[f"{steps[p][i]:.1f}" for p in PHASES]] for i, part in enumerate(parts)]
    print(table(["part", *PHASES], rows))
    print(f"\nOver one default impact (target: {TARGET} times the plant alone):\n")
    rows = []
    for audit, rung in ((False, "+ BallContact"), (True, "+ EnergyMeter")):
        counts, seconds = default_impact(audit=audit)
        wall = 1e6 * seconds / sum(counts.values())
        share = counts["contact"] / sum(counts.values())

        def mean(name: str, share: float = share) -> float:
            free, contact = (np.median(taken[phase, name]) for phase in PHASES)
            return (1.0 - share) * free + share * contact

        rows.append(
            [
                str(audit),
                f"{sum(counts.values())}",
                f"{share:.1%}",
                f"{1e6 * mean(rung):.1f}",
                f"{mean(rung) / mean('plant'):.2f}",
                f"{np.median(wall):.1f} ({np.min(wall):.1f})",
            ]
        )
    header = [
        "audit",
        "evaluations",
        "in contact",
        "mean, us",
        "/ plant",
        "wall per evaluation, us",
    ]
    print(table(header, rows), flush=True)


def main(
    repeats: Annotated[int, typer.Option(help="rounds of measurement")] = 60,
    numba: Annotated[bool, typer.Option(help="measure without numba too")] = True,
) -> None:
    """Measures the cost of one evaluation with numba and without."""
    report(repeats)
    if numba:
        script = Path(__file__).resolve()
        code = (
            "import runpy, sys; sys.modules['numba'] = None; sys.argv = sys.argv[1:];"
            " runpy.run_path(sys.argv[0], run_name='__main__')"
        )
        arguments = ["--no-numba", "--repeats", str(repeats)]
        command = [sys.executable, "-c", code, str(script), *arguments]
        subprocess.run(command, env=os.environ | {"PYTHONPATH": str(script.parent)}, check=True)


if __name__ == "__main__":
    typer.run(main)
