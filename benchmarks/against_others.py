"""One impact in drake_racket, in MuJoCo, and as hand-written NumPy under SciPy: error against time.

    python benchmarks/against_others.py        (needs the extra `bench`)

The same equations and numbers in three programs: tour racket (low tension), free, at rest; the ball
at 25 m/s along the normal onto the centre, from first touch to 8 ms, kb and cb as latched at that
speed. The ball leaves at about 5 ms; what follows is the racket's ringing.

    drake_racket  audit=False; the Simulator's AdvanceTo alone (building and parameters apart)
    compiled      the same Diagram in the compiled engine: the integration alone
    MuJoCo        RK4, contact in a passive-force callback: `mujoco_impact`
    NumPy         solve_ivp, RK45 and DOP853: `numpy_impact`

All find the release. First they must agree: each at its tightest setting, to 1e-6 m/s in the
rebound velocity. Then each runs over its settings in turns, and the median time is held against
the error |v - v_ref| / |v_ref|, v_ref from DOP853 at 1e-12. The time at an equal error is read from
each program's best settings (those that no other one beats in both) by lines in log-log; where the
cheapest setting is better than asked for, its time counts.

The last table is for orientation: what the package's own calls cost around AdvanceTo, and MuJoCo
without the callback, that is the engine and its bindings alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import matplotlib.pyplot as plt
import mujoco
import numpy as np
import typer
from impact_numbers import numbers_of
from measure import interleaved, table, versions
from mujoco_impact import MujocoImpact
from numpy.typing import NDArray
from numpy_impact import NumpyImpact
from pydrake.systems.analysis import Simulator

from drake_racket.cases.case import resolve
from drake_racket.cases.diagram import ImpactDiagram, make_impact_diagram
from drake_racket.engines.compiled.dynamics import layout
from drake_racket.engines.compiled.engine import SHARE_OF_ACCURACY, CompiledImpact
from drake_racket.engines.compiled.integrate import FINISHED
from drake_racket.engines.compiled.kernel import run_case
from drake_racket.engines.drake.engine import configure_integrator
from drake_racket.engines.drake.engine import run_drake as run_scenario
from drake_racket.laws.phases import SIZE
from drake_racket.parameters.scenario import IntegratorSettings, Scenario
from drake_racket.simulation import simulate

FIGURE = Path(__file__).parents[1] / "docs" / "figures" / "performance_against_others.png"
END = 0.008  # s, from touch
SCENARIO = Scenario(point="5", speed=25.0, approach_time=0.0, after=END, audit=False)
ACCURACIES = (1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 1e-5, 1e-6)
COMPILED = (1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7, 1e-8, 1e-9, 1e-10)
STEPS = (1e-4, 8e-5, 5e-5, 4e-5, 2e-5, 1.6e-5, 1e-5, 8e-6, 5e-6, 4e-6, 2e-6)
TOLERANCES = (1e-1, 5e-2, 2e-2, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
EQUAL_ERRORS = (1e-3, 1e-4, 1e-5, 1e-6, 1e-8)
AGREEMENT = 1e-6  # m/s


@dataclass(frozen=True)
class Trial:
    """One program at one setting; `call` runs it and returns the seconds that count."""

    program: str
    setting: str
    call: Callable[[], float]
    rebound: Callable[[], NDArray[np.float64]]
    evaluations: Callable[[], int]

    @property
    def name(self) -> str:
        """Program and setting."""
        return f"{self.program}, {self.setting}"


class DrakeImpact:
    """The package's run, with the Simulator's AdvanceTo timed alone."""

    def __init__(self, system: ImpactDiagram, settings: IntegratorSettings) -> None:
        self.system = system
        self.scenario = replace(SCENARIO, integrator=settings)
        self.simulator: Any = None

    def run(self) -> float:
        """Seconds of AdvanceTo."""
        self.simulator = Simulator(self.system.diagram, self.system.create_context(self.scenario))
        configure_integrator(self.simulator, self.scenario.integrator)
        self.simulator.Initialize()
        start = perf_counter()
        self.simulator.AdvanceTo(END)
        return perf_counter() - start

    def rebound(self) -> NDArray[np.float64]:
        """Velocity of the ball at the end; nothing acts on it after its release."""
        plant = self.system.plant
        context = plant.GetMyContextFromRoot(self.simulator.get_context())
        body = self.system.impact.ball.body
        return plant.EvalBodySpatialVelocityInWorld(context, body).translational()

    def evaluations(self) -> int:
        """Of the time derivatives."""
        return self.simulator.get_integrator().get_num_derivative_evaluations()


def drake_trial(system: ImpactDiagram, settings: IntegratorSettings) -> Trial:
    impact = DrakeImpact(system, settings)
    controlled = settings.error_control
    return Trial(
        f"drake_racket, RK3, {'error control' if controlled else 'fixed steps'}",
        f"accuracy {settings.accuracy:g}"
        if controlled
        else f"step {1e6 * settings.maximum_step:g} us",
        impact.run,
        impact.rebound,
        impact.evaluations,
    )


class CompiledRun:
    """The compiled engine's integration alone, as AdvanceTo is Drake's."""

    def __init__(self, compiled: CompiledImpact, accuracy: float) -> None:
        self.model, self.start = compiled.model, compiled.start(resolve(SCENARIO))
        self.tables = layout.open_model(self.model.ints, self.start.floats)
        self.accuracy = accuracy
        self.kept: tuple[NDArray[np.float64], int] = (np.zeros(0), 0)
        plant = compiled.system.plant
        ball = compiled.system.impact.ball.body
        self.at = plant.num_positions() + ball.floating_velocities_start_in_v() + 3

    def run(self) -> float:
        """Seconds of one integration."""
        y, records = self.start.y.copy(), np.zeros((1, SIZE))
        nothing = np.empty((0, 1 + len(y))), np.empty((0, 1, SIZE))
        longest = IntegratorSettings().maximum_step
        scale, accuracy = self.start.scale, self.accuracy
        begin = perf_counter()
        _, _, evaluations, how = run_case(
            self.tables, y, records, END, accuracy, longest, True, scale, *nothing
        )
        seconds = perf_counter() - begin
        assert how == FINISHED
        self.kept = y, evaluations
        return seconds

    def rebound(self) -> NDArray[np.float64]:
        """Velocity of the ball at the end."""
        return self.kept[0][self.at : self.at + 3]

    def evaluations(self) -> int:
        """Of the time derivatives."""
        return self.kept[1]


def compiled_trial(compiled: CompiledImpact, accuracy: float) -> Trial:
    own = CompiledRun(compiled, accuracy)
    setting = f"accuracy {accuracy / SHARE_OF_ACCURACY:g}"
    return Trial("drake_racket, compiled", setting, own.run, own.rebound, own.evaluations)


def mujoco_trial(impact: MujocoImpact, step: float) -> Trial:
    kept: dict[str, Any] = {}

    def run() -> float:
        start = perf_counter()
        kept["rebound"] = impact.run(step, END)
        return perf_counter() - start

    return Trial(
        "MuJoCo, RK4",
        f"step {1e6 * step:g} us",
        run,
        lambda: kept["rebound"],
        lambda: 4 * round(END / step),
    )


def numpy_trial(impact: NumpyImpact, method: str, tolerance: float) -> Trial:
    kept: dict[str, Any] = {}

    def run() -> float:
        start = perf_counter()
        kept["rebound"] = impact.run(method, tolerance, END)
        seconds = perf_counter() - start
        kept["evaluations"] = impact.evaluations
        return seconds

    return Trial(
        f"NumPy, {method}",
        f"rtol {tolerance:g}",
        run,
        lambda: kept["rebound"],
        lambda: kept["evaluations"],
    )


def engine_alone(impact: MujocoImpact, step: float) -> float:
    """Seconds of MuJoCo's steps without the callback, on the racket at rest."""
    mujoco.mj_resetData(impact.model, impact.data)
    impact.model.opt.timestep = step
    start = perf_counter()
    for _ in range(round(END / step)):
        mujoco.mj_step(impact.model, impact.data)
    return perf_counter() - start


def time_at(errors: NDArray[np.float64], times: NDArray[np.float64], target: float) -> float:
    """Time at the target error along the front of the settings; NaN where none reaches it."""
    front = [
        (e, t)
        for e, t in zip(errors, times, strict=True)
        if not np.any((errors <= e) & (times < t) | (errors < e) & (times <= t))
    ]
    e, t = np.log(np.transpose(sorted(front)))
    return float(np.exp(np.interp(np.log(target), e, t, left=np.nan)))


def agree(system: ImpactDiagram, numerical: NumpyImpact, engine: MujocoImpact) -> NDArray:
    """Prints how far the three are apart at tight settings; returns the reference."""
    reference = numerical.run("DOP853", 1e-12, END)
    tight = DrakeImpact(system, IntegratorSettings("runge_kutta3", 1e-9, 2e-5))
    tight.run()
    print("\nRebound velocity (m/s) at tight settings, and its distance from the first:\n")
    rows = []
    for name, velocity in (
        ("NumPy, DOP853, rtol 1e-12", reference),
        ("drake_racket, runge_kutta3, accuracy 1e-9", tight.rebound()),
        ("MuJoCo, RK4, step 1 us", engine.run(1e-6, END)),
    ):
        distance = float(np.linalg.norm(velocity - reference))
        rows.append([name, *[f"{v:.12f}" for v in velocity], f"{distance:.1e}"])
        assert distance < AGREEMENT, f"{name} is {distance} m/s from the reference"
    print(table(["program", "x", "y", "z", "distance"], rows), flush=True)
    return reference


def trials(system: ImpactDiagram, numerical: NumpyImpact, engine: MujocoImpact) -> list[Trial]:
    largest = IntegratorSettings().maximum_step
    compiled = CompiledImpact(system)
    return [
        *(compiled_trial(compiled, accuracy) for accuracy in COMPILED),
        *(
            drake_trial(system, IntegratorSettings("runge_kutta3", accuracy, largest))
            for accuracy in ACCURACIES
        ),
        *(
            drake_trial(system, IntegratorSettings("runge_kutta3", 1e-3, step, False))
            for step in STEPS
        ),
        *(mujoco_trial(engine, step) for step in STEPS),
        *(numpy_trial(numerical, method, t) for method in ("RK45", "DOP853") for t in TOLERANCES),
    ]


def plot(
    programs: dict[str, list[int]],
    errors: NDArray[np.float64],
    times: NDArray[np.float64],
    default: int,
    path: Path,
) -> None:
    figure, axis = plt.subplots(figsize=(7, 5.6), layout="constrained")
    styles = ("C3o-", "C0o-", "C0s--", "C1^-", "C2v-", "C2d--")
    for style, (program, rows) in zip(styles, programs.items(), strict=True):
        axis.loglog(1e3 * times[rows], errors[rows], style, markersize=4, label=program)
    axis.loglog(1e3 * times[default], errors[default], "k*", markersize=13, label="package default")
    axis.set_xlabel("time, ms (median)")
    axis.set_ylabel("error of the rebound velocity, relative")
    axis.grid(alpha=0.3)
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)


def main(
    repeats: Annotated[int, typer.Option(help="rounds of measurement")] = 15,
    out: Annotated[Path, typer.Option(help="the figure to write")] = FIGURE,
) -> None:
    """Checks that the three agree, measures them in turns, prints the tables, draws the figure."""
    print(f"## {versions('mujoco', 'scipy')}")
    system = make_impact_diagram(SCENARIO)
    numbers = numbers_of(SCENARIO)
    numerical, engine = NumpyImpact(numbers), MujocoImpact(numbers)
    reference = agree(system, numerical, engine)
    chosen = trials(system, numerical, engine)
    names = [trial.name for trial in chosen]
    calls: dict[str, Callable[[], object]] = {trial.name: trial.call for trial in chosen}
    around = {
        "AdvanceTo": DrakeImpact(system, IntegratorSettings()).run,
        "simulate.run": lambda: run_scenario(resolve(SCENARIO), system),
        "simulate, history=False": lambda: simulate(SCENARIO, system, history=False),
        "MuJoCo without callback, step 5 us": lambda: engine_alone(engine, 5e-6),
        "MuJoCo with callback, step 5 us": mujoco_trial(engine, 5e-6).call,
    }
    seconds = interleaved(calls | around, repeats)
    times = np.array([np.median(seconds[name]) for name in names])
    errors = np.array(
        [np.linalg.norm(t.rebound() - reference) / np.linalg.norm(reference) for t in chosen]
    )

    print(f"\nTime of one impact; median (minimum) of {repeats}.\n")
    rows = [
        [
            trial.program,
            trial.setting,
            f"{error:.1e}",
            f"{1e3 * time:.1f} ({1e3 * np.min(seconds[name]):.1f})",
            f"{trial.evaluations()}",
            f"{1e6 * time / trial.evaluations():.1f}",
        ]
        for trial, name, error, time in zip(chosen, names, errors, times, strict=True)
    ]
    header = ["program", "setting", "error", "time, ms", "evaluations", "us per evaluation"]
    print(table(header, rows))

    programs: dict[str, list[int]] = {}
    for row, trial in enumerate(chosen):
        programs.setdefault(trial.program, []).append(row)
    print("\nTime at equal error, ms (over MuJoCo's: of medians, of minimums; -: not reached):\n")
    least = np.array([np.min(seconds[name]) for name in names])
    engines = programs["MuJoCo, RK4"]
    rows = []
    for program, at in programs.items():
        cells = []
        for target in EQUAL_ERRORS:
            time, fastest = (time_at(errors[at], t[at], target) for t in (times, least))
            over = time / time_at(errors[engines], times[engines], target)
            over_least = fastest / time_at(errors[engines], least[engines], target)
            shown = f"{1e3 * time:.0f} ({over:.1f}, {over_least:.1f})"
            cells.append("-" if np.isnan(time) else shown)
        rows.append([program, *cells])
    print(table(["program", *[f"error {e:g}" for e in EQUAL_ERRORS]], rows))

    print("\nAround the run, ms, median (minimum):\n")
    rows = [
        [name, f"{1e3 * np.median(seconds[name]):.1f} ({1e3 * np.min(seconds[name]):.1f})"]
        for name in around
    ]
    print(table(["what", "time, ms"], rows))
    default = names.index(drake_trial(system, IntegratorSettings()).name)
    plot(programs, errors, times, default, out)


if __name__ == "__main__":
    typer.run(main)
