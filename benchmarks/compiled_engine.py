"""What the compiled engine costs: evaluations, an impact beside Drake's, a case, the first compile.

    python benchmarks/compiled_engine.py        (needs the extra `fast`; 2 minutes)

Evaluations are those of the equations alone, at the initial state, and those of whole runs with all
that a step needs. The impacts are 50 ms from touch on the centre at 25 m/s, without audit: each
engine at its loosest setting with an error of 1e-6 or less in the ball's rebound velocity, the
reference being the compiled engine at an accuracy of 1e-8; Drake's time is that of `run_drake`
without a history. Rounds run in turns; ratios are of medians. A case is one of a sweep of free
impacts, 10 ms from touch, in this process; what it takes to check it before is given apart. With
`--cases 30000` the rate of so many is measured by the clock, too, and this process's memory. The
first compile runs in a process of its own with an empty cache.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from time import perf_counter, process_time
from typing import Annotated, Any

import numpy as np
import typer
from measure import table, versions

from drake_racket.cases.case import resolve
from drake_racket.cases.diagram import make_impact_diagram
from drake_racket.engines.compiled.dynamics import layout
from drake_racket.engines.compiled.engine import SHARE_OF_ACCURACY, CompiledImpact
from drake_racket.engines.compiled.kernel import evaluate, run_case
from drake_racket.engines.drake.engine import run_drake
from drake_racket.laws.phases import SIZE
from drake_racket.parameters.scenario import IntegratorSettings, Scenario
from drake_racket.sweep.cases import make_plan
from drake_racket.sweep.runner import run_cases
from drake_racket.sweep.spec import make_sweep

IMPACT = Scenario(approach_time=0.0, after=0.05, audit=False)
ACCURACIES = (1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4)
ENOUGH = 1e-6
COMPILE = """
import time
import drake_racket as dr
from drake_racket.engines.compiled import engine
system = dr.make_impact_diagram(dr.Scenario(after=0.001))
start = time.process_time()
dr.simulate(dr.Scenario(after=0.001), system, engine="compiled", history=False)
print(time.process_time() - start)
"""


def evaluation(compiled: CompiledImpact) -> float:
    """Microseconds of the equations alone: the least of several loops."""
    start = compiled.start(compiled.system.case)
    tables = layout.open_model(compiled.model.ints, start.floats)
    tau, out = np.zeros(compiled.model.ints[layout.VELOCITIES]), np.zeros(len(start.y))
    work, records = layout.work_of(compiled.model.ints), np.zeros((1, SIZE))
    arguments = (tables, start.y, records, np.zeros(layout.ORIGIN_WORK), *work, tau, out)
    call = _looped()
    call(1, *arguments)
    best = np.inf
    for _ in range(9):
        begin = process_time()
        call(10_000, *arguments)
        best = min(best, process_time() - begin)
    return 1e6 * best / 10_000


def _looped() -> Any:
    import numba

    machine_code = evaluate.machine_code

    @numba.njit
    def loop(n, model, y, records, origin, w, leaves, tau, f):
        for _ in range(n):
            machine_code(model, y, records, origin, w, leaves, tau, f)

    return loop


def loosest(run: Any, case: Any, reference: Any) -> tuple[Any, float]:
    """The case with the loosest accuracy whose rebound velocity is within ENOUGH, and its error."""
    for accuracy in ACCURACIES:
        settings = IntegratorSettings(accuracy=accuracy)
        tried = replace(case, scenario=replace(case.scenario, integrator=settings))
        error = float(np.linalg.norm(run(tried) - reference) / np.linalg.norm(reference))
        if error <= ENOUGH:
            return tried, error
    raise SystemExit(f"no accuracy has an error of {ENOUGH:g}")


def beside_drake(support: str, repeats: int) -> list[str]:
    """One row: both engines on one impact."""
    case = resolve(replace(IMPACT, support=support))
    system = make_impact_diagram(case)
    compiled = CompiledImpact(system)

    def of_ball(trajectory: Any) -> Any:
        at = trajectory.mechanism.ball_velocity
        return trajectory.state[-1, at : at + 3]

    runs = {
        "compiled": lambda c: of_ball(compiled.run(c, every_sample=False)),
        "drake": lambda c: of_ball(run_drake(c, system, every_sample=False)),
    }
    exact = replace(case.scenario, integrator=IntegratorSettings(accuracy=1e-8))
    reference = runs["compiled"](replace(case, scenario=exact))
    chosen = {name: loosest(run, case, reference) for name, run in runs.items()}
    times: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(repeats):
        for name, run in runs.items():
            begin = perf_counter()
            run(chosen[name][0])
            times[name].append(perf_counter() - begin)
    medians = {name: float(np.median(seconds)) for name, seconds in times.items()}
    alone = integration(compiled, chosen["compiled"][0], repeats)
    return [
        support,
        *(
            f"{1e3 * medians[name]:.1f} (error {chosen[name][1]:.0e})"
            for name in ("drake", "compiled")
        ),
        f"{medians['drake'] / medians['compiled']:.0f}",
        f"{1e3 * alone:.1f}",
        f"{medians['drake'] / alone:.0f}",
    ]


def integration(compiled: CompiledImpact, case: Any, repeats: int) -> float:
    """Seconds of the compiled integration alone, without reading the case or making arrays."""
    start = compiled.start(case)
    tables = layout.open_model(compiled.model.ints, start.floats)
    nothing = np.empty((0, 1 + len(start.y))), np.empty((0, 1, SIZE))
    settings, end = case.scenario.integrator, case.scenario.after
    accuracy = SHARE_OF_ACCURACY * settings.accuracy
    seconds = []
    for _ in range(repeats):
        y, records = start.y.copy(), np.zeros((1, SIZE))
        begin = perf_counter()
        run_case(
            tables, y, records, end, accuracy, settings.maximum_step, True, start.scale, *nothing
        )
        seconds.append(perf_counter() - begin)
    return float(np.median(seconds))


def many_cases(count: int) -> str:
    """Rates of a sweep in this process, without its store and its comparison, and memory."""
    base = Scenario(after=0.01, approach_time=1e-4, audit=False)
    speeds = {"speed": {"from": 18.0, "to": 33.0, "count": count, "unit": "m/s"}}
    sweep = make_sweep(base, speeds, check={"most": 0})
    begin = process_time()
    plan = make_plan(sweep)
    checking = process_time() - begin
    list(run_cases(sweep, plan, range(5)))
    begin, since, done, early = process_time(), perf_counter(), 0, 0.0
    for batch in run_cases(sweep, plan, range(count)):
        done += len(batch)
        if done >= 1000 and not early:
            early = memory()
    spent, passed = process_time() - begin, perf_counter() - since
    text = (
        f"sweep: {count / spent:.0f} cases of 10 ms a second of CPU, {count / passed:.0f} a second;"
        f" {1e3 * checking / count:.2f} ms of CPU to check one before"
    )
    return text + (f"; {early:.0f} MB after 1,000, {memory():.0f} MB at the end" if early else "")


def memory() -> float:
    """Megabytes that this process has."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def first_compile() -> float:
    """Seconds of CPU of a first impact with an empty cache."""
    with tempfile.TemporaryDirectory() as cache:
        done = subprocess.run(
            [sys.executable, "-c", COMPILE],
            env=os.environ | {"NUMBA_CACHE_DIR": cache},
            capture_output=True,
            text=True,
            check=True,
        )
    return float(done.stdout)


def main(
    repeats: Annotated[int, typer.Option(help="rounds of measurement")] = 7,
    cases: Annotated[int, typer.Option(help="of the sweep")] = 300,
) -> None:
    """Measures and prints."""
    print(f"## {versions('numba')}\n")
    rows = []
    for support in ("free", "grip", "limb"):
        compiled = CompiledImpact(make_impact_diagram(replace(IMPACT, support=support)))
        case = compiled.system.case
        start = compiled.start(case)
        compiled.run_from(case, start, every_sample=False)
        begin = process_time()
        run = compiled.run_from(case, start, every_sample=False)
        whole = 1e6 * (process_time() - begin) / run.evaluations
        rows.append([support, f"{evaluation(compiled):.2f}", f"{whole:.2f}"])
    print(table(["evaluation, us", "equations alone", "whole run and its arrays"], rows))
    print("\n50 ms from touch, ms, at an error of 1e-6 or less:\n")
    rows = [beside_drake(support, repeats) for support in ("free", "limb")]
    print(table(["support", "Drake", "compiled", "ratio", "integration alone", "ratio"], rows))
    print(f"\n{many_cases(cases)}")
    print(f"first impact with an empty cache: {first_compile():.1f} s of CPU")


if __name__ == "__main__":
    typer.run(main)
