"""54 head-clamped impacts (nine points, six speeds): the batch kernel against other ways.

    python benchmarks/clamped_batch.py [--repeats 7] [--out docs/figures/clamped_batch.csv]

In one run, each at the coarsest setting whose rebound speeds are within 1e-4 of the converged ones:
the compiled kernel, the Drake rig (its Diagram built before), scipy's
solve_ivp (RK45) over the same laws, and the barest compiled loop (`minimal_clamped`). Ratios are
those of the medians.
"""

from __future__ import annotations

import argparse
import csv
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import minimal_clamped
import numpy as np
from scipy.integrate import solve_ivp

from drake_racket import IntegratorSettings, Scenario, make_impact_diagram, simulate
from drake_racket.cases.case import changed
from drake_racket.engines.clamped.batch import bed_parameters, make_bed, make_impacts, run
from drake_racket.laws.bed import POINT_NUMBERS
from drake_racket.laws.contact import contact_law
from drake_racket.laws.strings import generalized_forces
from drake_racket.parameters.ball import load_ball
from drake_racket.parameters.racket import load_racket
from drake_racket.rigs.head_clamped import CANNON_SPEEDS, head_clamped_scenario

POINT = np.repeat(POINT_NUMBERS, len(CANNON_SPEEDS))
SPEED = np.tile(CANNON_SPEEDS, len(POINT_NUMBERS))
TARGET = 1e-4


def by_kernel(bed, impacts, step: float) -> np.ndarray:
    return run([bed], impacts, step=step).values[:, 2]


def by_minimal(bed, impacts, step: float) -> np.ndarray:
    return minimal_clamped.rebounds(
        bed.constants, POINT - 1, SPEED, impacts.balls, bed.mass, impacts.ball_mass, step
    )


def by_drake(system, base: Scenario, settings: IntegratorSettings) -> np.ndarray:
    speeds = []
    for point, speed in zip(POINT, SPEED, strict=True):
        case = changed(base, point=int(point), speed=float(speed), integrator=settings)
        speeds.append(simulate(case, system, history=False).rebound_velocity[2])
    return np.array(speeds)


def by_solve_ivp(bed, impacts, rtol: float) -> np.ndarray:
    speeds, incidence = [], bed.topology.incidence
    for point, velocity, ball in zip(POINT - 1, impacts.velocities, impacts.balls, strict=True):

        def contact(y, p=point, ball=ball):
            return contact_law((0.0, 0.0, y[18] - y[p]), (0.0, 0.0, y[19] - y[9 + p]), ball)

        def rates(t, y, p=point, contact=contact):
            force = contact(y)[2]
            f = np.empty(20)
            f[:9], f[18] = y[9:18], y[19]
            f[9:18] = generalized_forces(*y[:18].reshape(2, 9), bed.constants, incidence) / bed.mass
            f[9 + p] -= force / bed.mass
            f[19] = force / impacts.ball_mass
            return f

        def released(t, y, contact=contact):
            return contact(y)[3]

        released.terminal, released.direction = True, -1
        start = np.zeros(20)
        start[19] = velocity[2]
        solution = solve_ivp(rates, (0.0, 0.02), start, events=released, rtol=rtol, atol=1e-7)
        speeds.append(solution.y[19, -1])
    return np.array(speeds)


def ways(racket, ball) -> dict[str, tuple[Callable[..., np.ndarray], list]]:
    """Name -> a function of its setting, and settings from coarse to fine."""
    bed, impacts = make_bed(racket), make_impacts(racket, ball, POINT, SPEED)
    names, _ = bed_parameters(racket)
    with_all = make_bed(racket, free=names)
    with_all_impacts = make_impacts(racket, ball, POINT, SPEED, free=len(names))
    base = head_clamped_scenario()
    system = make_impact_diagram(base)
    steps = [1e-4, 8e-5, 6e-5, 4e-5, 2e-5, 1e-5, 5e-6]
    settings = [IntegratorSettings(accuracy=a) for a in (1e-2, 1e-3, 2e-4, 5e-5)]
    return {
        "compiled kernel": (lambda h: by_kernel(bed, impacts, h), steps),
        "compiled kernel with 11 sensitivities": (
            lambda h: by_kernel(with_all, with_all_impacts, h),
            steps,
        ),
        "barest compiled loop": (lambda h: by_minimal(bed, impacts, h), steps),
        "solve_ivp loop": (lambda r: by_solve_ivp(bed, impacts, r), [1e-2, 1e-3, 1e-4, 1e-5]),
        "Drake rig": (lambda s: by_drake(system, base, s), settings),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    racket, ball = load_racket(), load_ball()
    converged = by_kernel(make_bed(racket), make_impacts(racket, ball, POINT, SPEED), 1e-6)
    chosen = {}
    for name, (way, settings) in ways(racket, ball).items():
        for setting in settings:
            error = float(np.abs(way(setting) / converged - 1.0).max())
            if error <= TARGET:
                break
        chosen[name] = way, setting, error
    times: dict[str, list[float]] = {name: [] for name in chosen}
    for _ in range(arguments.repeats):
        for name, (way, setting, _) in chosen.items():
            calls = 20 if name.startswith(("compiled", "barest")) else 1
            start = time.perf_counter()
            for _ in range(calls):
                way(setting)
            times[name].append((time.perf_counter() - start) / calls)
    medians = {name: statistics.median(x) for name, x in times.items()}
    rows = [
        (name, str(setting), f"{error:.1e}", f"{1e3 * medians[name]:.3g}",
         f"{medians[name] / medians['compiled kernel']:.3g}")
        for name, (_, setting, error) in chosen.items()
    ]  # fmt: skip
    header = ("way", "setting", "largest error [1]", "median time [ms]", "times the kernel")
    for row in (header, *rows):
        print(f"{row[0]:38} {row[2]:>18} {row[3]:>17} {row[4]:>17}  {row[1]}")
    if arguments.out is not None:
        with arguments.out.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([header, *rows])


if __name__ == "__main__":
    main()
