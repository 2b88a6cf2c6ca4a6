"""Error of an impact against the work that it takes, over integrators; and their observed order.

    python benchmarks/work_precision.py

Three impacts on the free tour racket (low tension), from 1 ms before touch to 10 ms after it:
normal on the centre at 25 m/s, normal on a corner at 25 m/s, and 17 degrees oblique on the edge at
31 m/s. Each is run with every scheme that a scenario may name, with fixed steps and, but for
runge_kutta2 which has no error estimate, with error control over accuracies (largest step as in the
default settings). What is recorded is

    rebound error   |v - v_ref| / |v_ref|, v the ball's velocity at its last release
    energy error    change of the audited total over the run / initial kinetic energy
    work            evaluations of the time derivatives

The reference is runge_kutta3 at accuracy 1e-9 with steps of 20 us or less; its distance from
runge_kutta5 with fixed steps of 2 us is printed, and errors near it mean nothing. nan: diverged.

The observed order is the slope of log error over log step of fixed steps against that same
runge_kutta5, for the coarse and for the fine half of the steps, over the errors between 1e-3 and a
floor: 1e-12 from touch on, 1e-8 where touch has to be found (it is found to about a nanosecond).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import matplotlib.pyplot as plt
import numpy as np
import typer
from measure import table, versions
from numpy.typing import NDArray

from drake_racket.cases.diagram import ImpactDiagram, make_impact_diagram
from drake_racket.io.errors import SimulationError
from drake_racket.parameters.scenario import SCHEMES, IntegratorSettings, Scenario
from drake_racket.results.impact import ImpactResult
from drake_racket.simulation import simulate

FIGURE = Path(__file__).parents[1] / "docs" / "figures" / "performance_work_precision.png"
CASES = {
    "centre, 25 m/s": Scenario(point="5", after=0.01),
    "corner, 25 m/s": Scenario(point="1", after=0.01),
    "edge, 31 m/s at 17 deg": Scenario(point="4", speed=31.0, incidence_deg=17.0, after=0.01),
}
ACCURACIES = (1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 1e-5, 1e-6, 1e-7)
STEPS = (2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6, 2e-6, 1e-6)
CONTROLLED = SCHEMES[1:]  # Drake's runge_kutta2 has no error estimate
REFERENCE = IntegratorSettings("runge_kutta3", 1e-9, 2e-5)
CHECK = IntegratorSettings("runge_kutta5", 1e-3, 2e-6, error_control=False)

TOUCHING = Scenario(approach_time=0.0, after=0.01)
CLAMPED = replace(TOUCHING, support="clamped_head")
ORDER_CASES = {
    "head clamped, from touch": CLAMPED,
    "head clamped, touch found": replace(CLAMPED, approach_time=0.001),
    "free, 60 deg: slides throughout": replace(TOUCHING, incidence_deg=60.0),
    "free, 17 deg: slides, then sticks": replace(TOUCHING, incidence_deg=17.0),
    "free, 0 deg: sticks from touch": TOUCHING,
}
ORDER_STEPS = (2e-4, 1e-4, 5e-5, 2.5e-5, 1.25e-5, 6.25e-6, 3.125e-6, 1.5625e-6)
COARSE, FINE = slice(0, 4), slice(4, 8)  # of ORDER_STEPS, for the two fits
LARGEST, FLOOR, FLOOR_FOUND = 1e-3, 1e-12, 1e-8  # errors that the order is fitted to


@dataclass(frozen=True)
class Point:
    """One run, measured against the reference; NaN where it could not be finished."""

    settings: IntegratorSettings
    rebound_error: float
    energy_error: float
    steps: int
    evaluations: int


def run(scenario: Scenario, system: ImpactDiagram, settings: IntegratorSettings) -> ImpactResult:
    """One impact with the settings."""
    return simulate(replace(scenario, integrator=settings), system, history=False)


def difference(velocity: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(velocity - reference) / np.linalg.norm(reference))


def compare(
    scenario: Scenario,
    system: ImpactDiagram,
    settings: IntegratorSettings,
    reference: NDArray[np.float64],
) -> Point:
    try:
        result = run(scenario, system, settings)
    except SimulationError:
        return Point(settings, np.nan, np.nan, 0, 0)
    error = difference(result.rebound_velocity, reference)
    energy = result.energy_error
    return Point(
        settings, error, np.nan if energy is None else energy, result.steps, result.evaluations
    )


def work_precision(scenario: Scenario) -> tuple[ImpactResult, float, list[Point]]:
    """The reference, its distance from the check, and the runs; the last is the default."""
    system = make_impact_diagram(scenario)
    reference = run(scenario, system, REFERENCE)
    velocity = reference.rebound_velocity
    distance = difference(run(scenario, system, CHECK).rebound_velocity, velocity)
    default = IntegratorSettings()
    settings = [
        *(IntegratorSettings(s, a, default.maximum_step) for s in CONTROLLED for a in ACCURACIES),
        *(IntegratorSettings(s, 1e-3, h, error_control=False) for s in SCHEMES for h in STEPS),
        default,
    ]
    return reference, distance, [compare(scenario, system, s, velocity) for s in settings]


def order(scenario: Scenario, scheme: str) -> tuple[list[float], float, float]:
    """Rebound errors over ORDER_STEPS, and the slopes of the coarse and of the fine steps."""
    scenario = replace(scenario, audit=False)
    system = make_impact_diagram(scenario)
    reference = run(scenario, system, CHECK).rebound_velocity
    errors = []
    for step in ORDER_STEPS:
        settings = IntegratorSettings(scheme, 1e-3, step, error_control=False)
        errors.append(compare(scenario, system, settings, reference).rebound_error)
    floor = FLOOR_FOUND if scenario.approach_time else FLOOR
    coarse, fine = (slope(ORDER_STEPS[part], errors[part], floor) for part in (COARSE, FINE))
    return errors, coarse, fine


def slope(steps: Sequence[float], errors: Sequence[float], floor: float) -> float:
    """Of log error over log step, over errors from `floor` to LARGEST; NaN with less than two."""
    kept = [(h, e) for h, e in zip(steps, errors, strict=True) if floor < e < LARGEST]
    if len(kept) < 2:
        return float("nan")
    return float(np.polyfit(*np.log(np.transpose(kept)), 1)[0])


def name(settings: IntegratorSettings) -> str:
    if settings.error_control:
        return f"accuracy {settings.accuracy:g}"
    return f"step {1e6 * settings.maximum_step:g} us"


def plot(found: dict[str, list[Point]], path: Path) -> None:
    """Rebound and energy error over evaluations, one column per case."""
    figure, axes = plt.subplots(
        2, len(found), figsize=(11, 6.6), sharex=True, sharey="row", layout="constrained"
    )
    for column, (case, points) in enumerate(found.items()):
        for row, quantity in enumerate(("rebound_error", "energy_error")):
            axis = axes[row, column]
            for color, scheme in zip(("C0", "C1", "C2"), SCHEMES, strict=True):
                for control, style in ((True, "o-"), (False, "x:")):
                    chosen = [
                        p
                        for p in points[:-1]
                        if p.settings.scheme == scheme and p.settings.error_control == control
                    ]
                    if not chosen:
                        continue
                    axis.loglog(
                        [p.evaluations or np.nan for p in chosen],
                        [getattr(p, quantity) for p in chosen],
                        style,
                        color=color,
                        markersize=4,
                        linewidth=1.2,
                        label=f"{scheme}, {'error control' if control else 'fixed steps'}",
                    )
            default = points[-1]
            axis.loglog(
                default.evaluations,
                getattr(default, quantity),
                "k*",
                markersize=13,
                label="default",
            )
            axis.set_ylim(3e-12, 3.0)
            axis.grid(alpha=0.3)
        axes[0, column].set_title(case)
        axes[1, column].set_xlabel("evaluations")
    axes[0, 0].set_ylabel("rebound error, relative")
    axes[1, 0].set_ylabel("energy error, relative")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)


def main(out: Annotated[Path, typer.Option(help="the figure to write")] = FIGURE) -> None:
    """Runs everything, prints the tables and writes the figure."""
    print(f"## {versions()}")
    found: dict[str, list[Point]] = {}
    for case, scenario in CASES.items():
        reference, distance, points = work_precision(scenario)
        found[case] = points
        velocity = ", ".join(f"{v:.9g}" for v in reference.rebound_velocity)
        print(f"\n### {case}\n")
        print(f"reference ({velocity}) m/s after {reference.touches} touch(es);", end=" ")
        print(f"the two references differ by {distance:.1e}\n")
        rows = [
            [
                "default" if p is points[-1] else p.settings.scheme,
                name(p.settings),
                f"{p.rebound_error:.1e}",
                f"{p.energy_error:.1e}",
                f"{p.steps}",
                f"{p.evaluations}",
            ]
            for p in points
        ]
        header = ["scheme", "setting", "rebound error", "energy error", "steps", "evaluations"]
        print(table(header, rows), flush=True)
    plot(found, out)

    print("\n### observed order of fixed steps\n")
    rows = []
    for case, scenario in ORDER_CASES.items():
        for scheme in SCHEMES:
            errors, *slopes = order(scenario, scheme)
            shown = [f"{e:.1e}" for e in errors]
            shown += ["-" if np.isnan(s) else f"{s:.1f}" for s in slopes]
            rows.append([case, scheme, *shown])
    steps = [f"{1e6 * h:g} us" for h in ORDER_STEPS]
    header = ["case", "scheme", *steps, "order, coarse", "order, fine"]
    print(table(header, rows), flush=True)


if __name__ == "__main__":
    typer.run(main)
