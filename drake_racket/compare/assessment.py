"""Computes what a racket does: to a ball at nine points, in a swing, and to the hand.

*At rest*: the free racket is hit at its string-bed points at one speed; apparent restitution e is
the normal rebound speed over the approach speed.

*In a swing*: the racket turns at `rate` about an axis `pivot` behind its butt and meets a ball of
`ball_speed`. Where it is hit, x from the butt, it moves at V = rate (x + pivot); seen from there
the ball comes with V + ball_speed, and leaves over the court with

    e(x) (V + ball_speed) + V.

e is computed for every x at that x's own speed; while the ball is on the strings (5 ms) the
racket's own turning by less than 10 degrees is left out.

*Hand*: the racket in a hand-like grip at rest (its numbers are inferred), hit at the centre.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from drake_racket.cases.case import Case, resolve
from drake_racket.cases.diagram import ImpactDiagram, make_impact_diagram
from drake_racket.compare.numbers import NINE
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Progress, Report
from drake_racket.parameters.overrides import apply_overrides
from drake_racket.parameters.racket import RacketParameters
from drake_racket.parameters.scenario import IntegratorSettings, Scenario
from drake_racket.plant.properties import SWINGWEIGHT_AXIS, RacketProperties, racket_properties
from drake_racket.results.impact import ImpactResult, make_result
from drake_racket.results.outputs import OUTPUTS
from drake_racket.rigs.modes.shapes import head_node
from drake_racket.simulation import simulate
from drake_racket.sweep.worker import may_run_compiled

if TYPE_CHECKING:
    from drake_racket.engines.compiled.engine import CompiledImpact

AXIS_STEP = 0.02  # m
AXIS_REACH = 0.75  # of the rim's longer semi-axis
COARSE = IntegratorSettings(accuracy=2e-2)
"""Of Drake's engine: moves restitution by 1e-5, and ringing by less than 1 %."""


@dataclass(frozen=True)
class Swing:
    """A swing turns the racket about an axis along y, `pivot` (m) behind its butt.

    `rate` in rad/s, `ball_speed` (m/s) towards the racket.
    """

    rate: float = 27.0
    pivot: float = 0.2
    ball_speed: float = 10.0

    def __post_init__(self) -> None:
        """Refuses what is no swing."""
        for key, value, most in (
            ("rate", self.rate, 100.0),
            ("pivot", self.pivot, 2.0),
            ("ball_speed", self.ball_speed, 60.0),
        ):
            if not 0.0 <= value <= most:
                raise InputError(f"swing: {key}", value, f"0 to {most:g}")

    def racket_speed(self, place: float) -> float:
        """Gives the racket's speed (m/s) at `place` (m from the butt)."""
        return self.rate * (place + self.pivot)


@dataclass(frozen=True)
class Assessment:
    """An assessment is one racket in numbers, SI; `numbers` names them.

    Attributes:
        values: by the names of `numbers.NUMBERS`.
        offsets: (n,) aims on the long axis, m from the string-bed centre towards the tip.
        restitution, ball_speed: (n,) of the swing at these aims.

    """

    racket: RacketParameters
    values: Mapping[str, float]
    offsets: NDArray[np.float64]
    restitution: NDArray[np.float64]
    ball_speed: NDArray[np.float64]


@dataclass
class Bench:
    """The bench runs impacts on rackets, with one Diagram for all of one topology.

    As sweeps do, it takes the compiled engine where it can, unless the base names another.

    Attributes:
        base: what every impact has: its speed, ball, grip, engine.

    """

    base: Scenario
    _diagrams: dict[tuple[object, ...], ImpactDiagram] = field(default_factory=dict)
    _models: dict[tuple[object, ...], CompiledImpact | None] = field(default_factory=dict)

    def run(
        self, racket: RacketParameters, *, history: bool = False, **changes: object
    ) -> ImpactResult:
        """Runs one impact on this racket."""
        scenario = dataclasses.replace(self.base, **changes)  # type: ignore[arg-type]
        case = resolved(racket, scenario)
        if case.topology not in self._diagrams:
            self._diagrams[case.topology] = system = make_impact_diagram(case)
            self._models[case.topology] = _compiled(system) if may_run_compiled(scenario) else None
        model = self._models[case.topology]
        if model is None:
            return simulate(case, self._diagrams[case.topology], history=history)
        return make_result(case, model.run(case, every_sample=history), history=history)


def _compiled(system: ImpactDiagram) -> CompiledImpact:
    from drake_racket.engines.compiled.engine import CompiledImpact

    return CompiledImpact(system)


def resolved(racket: RacketParameters, scenario: Scenario) -> Case:
    """Gives the case of a racket that is not (yet) a file; the scenario's own is not looked at."""
    plain = {k: v for k, v in scenario.overrides.items() if not k.startswith("racket.")}
    # aimed and checked on the shipped racket, which may be smaller than this one
    centred = dataclasses.replace(
        scenario, racket="tour", tension="low", overrides=plain, offset_x=0.0, offset_y=0.0
    )
    case = resolve(centred)
    aimed = dataclasses.replace(
        case.scenario, offset_x=scenario.offset_x, offset_y=scenario.offset_y
    )
    return dataclasses.replace(case, scenario=aimed, racket=racket)


def usual_scenario(base: Scenario | None = None) -> Scenario:
    """Gives what the impacts of an assessment share: 25 m/s at the centre of a free racket."""
    base = base or Scenario()
    own = base.integrator != IntegratorSettings() or may_run_compiled(base)
    integrator = base.integrator if own else COARSE
    return dataclasses.replace(
        base, approach_time=1e-4, after=0.008, audit=False, integrator=integrator
    )


def aims(racket: RacketParameters) -> NDArray[np.float64]:
    """Gives the aims on the long axis (m from the string-bed centre)."""
    count = int(AXIS_REACH * racket.string_bed.rim_semi_axis_x.value / AXIS_STEP)
    return np.asarray(AXIS_STEP * np.arange(-count, count + 1), dtype=np.float64)


def assess(
    racket: RacketParameters,
    *,
    base: Scenario | None = None,
    swing: Swing | None = None,
    bench: Bench | None = None,
    progress: Report | None = None,
    hand: bool = True,
) -> Assessment:
    """Computes an assessment.

    Args:
        base: speed of the nine points, ball, grip, integrator; see `usual_scenario`.
        bench: to share Diagrams between rackets of one topology.
        hand: with vibration and the hand's load, which take half of the time.

    """
    swing = swing or Swing()
    bench = bench or Bench(usual_scenario(base))
    racket = apply_overrides(racket, bench.base.overrides)
    offsets = aims(racket)
    steps = _Steps(progress, f"impacts on {racket.name}", 9 + len(offsets) + 2 * hand)
    values = static_numbers(racket)
    for point, name in enumerate(NINE, 1):
        mirrored = NINE[_LEFT[point] - 1] if point in _LEFT and alike_on_both_sides(racket) else ""
        if mirrored:
            values[name] = values[mirrored]
        else:
            found = bench.run(racket, point=str(point), support="free")
            values[name] = found.apparent_restitution
        steps.next()
    restitution, leaving = [], []
    for offset in offsets.tolist():
        speed = swing.racket_speed(racket.centre()[0] + offset)
        towards = max(speed + swing.ball_speed, 0.1)
        found = bench.run(
            racket, point="auto", offset_x=offset, offset_y=0.0, speed=towards, support="free"
        )
        restitution.append(found.apparent_restitution)
        leaving.append(found.apparent_restitution * towards + speed)
        steps.next()
    values |= _best(offsets, np.array(restitution), np.array(leaving))
    if hand:
        values |= _shaking(bench, racket, steps)
    return Assessment(racket, values, offsets, np.array(restitution), np.array(leaving))


_LEFT = {3: 1, 6: 4, 9: 7}
"""Point on the right -> the one across the long axis."""


def alike_on_both_sides(racket: RacketParameters) -> bool:
    """Tells whether frame and string-bed are the same left and right of the long axis."""
    parts = (racket.handle, racket.head)
    if any(part.centre()[1] or part.product() for part in parts):
        return False
    across = {str(b): str(a) for pair in _LEFT.items() for a, b in (pair, pair[::-1])}
    across |= {"left": "right", "right": "left"}

    def mirror(name: str) -> frozenset[str]:
        return frozenset(across.get(end, end) for end in name.split("-"))

    springs = {frozenset(name.split("-")): k for name, k in racket.string_bed.springs.value.items()}
    return all(springs[mirror("-".join(ends))] == k for ends, k in springs.items())


def static_numbers(racket: RacketParameters) -> dict[str, float]:
    """Gives what no impact is needed for: mass, moments, fundamentals, node, percussion."""
    p = racket_properties(racket)
    centre = racket.centre()[0]
    return {
        "mass": p.mass,
        "balance": p.balance,
        "swingweight": p.swingweight,
        "twistweight": p.twistweight,
        "frequency_out_of_plane": p.out_of_plane_frequency,
        "frequency_in_plane": p.in_plane_frequency,
        "node_place": head_node(racket) - centre,
        "percussion_place": percussion(p, racket.landmarks.grip.value) - centre,
    }


def percussion(properties: RacketProperties, hand: float) -> float:
    """Gives the centre of percussion (m from the butt) of the rigid racket for `hand`.

    A ball that strikes there does not move the hand's place: l = b + I / (m (b - h)), with I about
    the centre of mass.
    """
    p = properties
    about_com = p.swingweight - p.mass * (p.balance - SWINGWEIGHT_AXIS) ** 2
    return p.balance + about_com / (p.mass * (p.balance - hand))


def _shaking(bench: Bench, racket: RacketParameters, steps: _Steps) -> dict[str, float]:
    """Vibration of the free racket, and the load on a hand, for a ball at the centre."""
    free = bench.run(racket, history=True, point="5", support="free", after=0.03)
    steps.next()
    held = bench.run(racket, history=True, point="5", support="grip", after=0.03)
    steps.next()
    names = {
        "peak_handle_acceleration": free,
        "handle_ringing": free,
        "peak_hand_force": held,
        "peak_hand_torque": held,
    }
    return {name: OUTPUTS[name].read(result) for name, result in names.items()}


def _best(
    offsets: NDArray[np.float64],
    restitution: NDArray[np.float64],
    leaving: NDArray[np.float64],
) -> dict[str, float]:
    """The best aims; at the centre, and where ball speed and restitution are highest."""
    middle, best = int(np.argmin(np.abs(offsets))), int(np.argmax(leaving))
    return {
        "swing_speed_centre": float(leaving[middle]),
        "swing_speed_best": float(leaving[best]),
        "swing_best_place": float(offsets[best]),
        "restitution_best_place": float(offsets[int(np.argmax(restitution))]),
    }


class _Steps:
    """Counts the impacts for whoever waits."""

    def __init__(self, report: Report | None, task: str, total: int) -> None:
        self._report, self._task, self._total, self._done = report, task, total, 0

    def next(self) -> None:
        """One impact is done."""
        self._done += 1
        if self._report is not None:
            self._report(Progress(self._task, self._done, self._total))
