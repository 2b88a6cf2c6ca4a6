"""What derivatives cost: the tangents of a run beside the run, and all of them beside one impact.

    python benchmarks/tangents.py        (needs the extra `fast`; three minutes)

A run is the compiled engine's integration of an impact at the centre, 25 m/s, 8 ms from touch. Its
tangents are those by 4, 8 and 12 parameters at once. The last column is `simulate` with as many
derivatives of all numbers, without a history, over `simulate` without them; resolving the scenario
twice a parameter is in it. Rounds run in turns; ratios are of medians. The first compile, of the
engine and of its tangents, runs in a process of its own with an empty cache.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import replace
from statistics import median
from time import perf_counter, process_time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from measure import table, versions

from drake_racket import derivatives
from drake_racket.cases.case import load_scenario, resolve
from drake_racket.cases.diagram import make_impact_diagram
from drake_racket.engines.compiled.engine import blank_records
from drake_racket.engines.compiled.tangents.path import tangents_of
from drake_racket.parameters.scenario import IntegratorSettings, Scenario
from drake_racket.simulation import simulate

KEYS = (
    "racket.head.mass",
    "racket.handle.mass",
    "racket.head.moi_frontal",
    "racket.throat_joint.out_of_plane_stiffness",
    "racket.string_bed.initial_tension",
    "racket.string_bed.stiffness.k1",
    "racket.string_bed.stiffness.k2",
    "racket.friction.coefficients.mu1",
    "ball.stiffness_low",
    "ball.damping_low",
    "ball.mass",
    "speed",
)
SETTINGS = IntegratorSettings(accuracy=1e-2)
CASES = {
    "free": Scenario(after=0.008, engine="compiled", audit=False, integrator=SETTINGS),
    "hand": Scenario(
        support="grip", after=0.008, engine="compiled", audit=False, integrator=SETTINGS
    ),
    "limb": replace(load_scenario("backhand"), after=0.008, engine="compiled", integrator=SETTINGS),
}
ROUNDS = 15
COMPILE = """
import time
import drake_racket as dr
scenario = dr.Scenario(after=0.001, engine="compiled")
system = dr.make_impact_diagram(scenario)
start = time.process_time()
dr.simulate(scenario, system, history=False)
between = time.process_time()
dr.simulate(scenario, system, derivatives=["speed"], history=False)
print(between - start, time.process_time() - between)
"""


def timed(call) -> float:
    """CPU seconds of one call."""
    start = process_time()
    call()
    return process_time() - start


def row(name: str, scenario: Scenario, count: int) -> list[str]:
    """One line of the table."""
    case = resolve(scenario)
    model = derivatives.compiled_model(make_impact_diagram(case))
    parameters = derivatives.parameters_of(case, KEYS[:count])
    variations = [derivatives.vary(case, p) for p in parameters]
    start = model.start(case)
    starts = [[model.start(varied) for varied in v.cases] for v in variations]
    directions = derivatives.directions_of(variations, starts)
    start = model.start(case)
    kept = model.samples(case, start)
    ints = model.model.ints

    def tangents() -> None:
        tangents_of(
            ints, start.floats, kept.values, kept.records, blank_records(ints), start.scale,
            directions,
        )  # fmt: skip

    def whole(keys) -> None:
        simulate(scenario, derivatives=keys, history=False)

    runs, follow, plain, told = [], [], [], []
    whole(KEYS[:count])
    for _ in range(ROUNDS):
        runs.append(timed(lambda: model.samples(case, start)))
        follow.append(timed(tangents))
        plain.append(timed(lambda: whole(None)))
        told.append(timed(lambda: whole(KEYS[:count])))
    share = median(follow) / median(runs)
    return [
        name,
        str(count),
        f"{1e3 * median(runs):.1f}",
        f"{1e3 * median(follow):.1f}",
        f"{share / count:.2f}",
        f"{median(told) / median(plain):.1f}",
    ]


def first_compile() -> list[float]:
    """CPU seconds of the first compiled run, and of the first derivatives after it."""
    with tempfile.TemporaryDirectory() as cache:
        done = subprocess.run(
            [sys.executable, "-c", COMPILE],
            env=os.environ | {"NUMBA_CACHE_DIR": cache},
            capture_output=True,
            text=True,
            check=True,
        )
    return [float(text) for text in done.stdout.split()]


def main() -> None:
    """Runs and prints."""
    begin = perf_counter()
    rows = [row(name, case, count) for name, case in CASES.items() for count in (1, 4, 8, 12)]
    header = ["racket", "parameters", "run (ms)", "tangents (ms)", "share of a run each", "whole"]
    print(table(header, rows))
    run, tangents = first_compile()
    print(f"\nfirst compile: run {run:.0f} s, its tangents {tangents:.0f} s of CPU")
    print(f"\n{versions()}; {perf_counter() - begin:.0f} s")


if __name__ == "__main__":
    main()
