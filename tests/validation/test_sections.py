"""Sections of the validation on experiments that are made of formulas: what is asked of each
experiment, which number becomes which row, and what the text says.
"""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray

import drake_racket as dr
from drake_racket.cases.case import resolve
from drake_racket.validation import frame, hand, impacts, spin
from drake_racket.validation.outcome import Plan
from tests.recorded import check_record
from tests.rigs import made_data
from tests.stand import Stand

RECORDS = Path(__file__).parent / "records"
PLAN = Plan(points=(2, 4, 5, 8), speeds=(18.0, 25.0, 33.0), axis_step=0.035, forces=(1.0, 800.0))


class Section(Stand):
    """Stands for the experiments of a section's module."""

    def check(self, section: Any, name: str, plan: Plan = PLAN) -> None:
        """Runs the section and compares all it gives with the record."""
        steps: list[Any] = []
        found = section(plan, steps.append)
        check_record(
            {
                "asked": self.asked,
                "steps": [[now.done, now.total] for now in steps],
                "values": found.values,
                "text": found.text,
                "datasets": list(found.datasets),
                "figures": {key: caption for key, (caption, _) in found.figures.items()},
            },
            RECORDS / f"{name}.json",
        )


@pytest.fixture
def stand(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Makes a Section of a module, until the test ends."""
    return lambda module: Section(monkeypatch, module)


def outcome(number: float, **more: Any) -> SimpleNamespace:
    return SimpleNamespace(restitution=number, apparent_restitution=number, **more)


def test_force_plate(stand: Any) -> None:
    on = stand(frame)
    on.let(
        "plate_dataset", lambda speeds, settings: made_data.plate().assign_coords(speed=[*speeds])
    )
    drops = iter([0.74, 0.73, 0.71])

    def run(speed: float, ball: Any = None) -> SimpleNamespace:
        on.asked.append([speed, ball and [ball.name, ball.normal]])
        return outcome(next(drops))

    on.let("make_force_plate", lambda: SimpleNamespace(run=run))
    on.check(frame.force_plate, "force_plate")


def test_frame_modes(stand: Any) -> None:
    on = stand(frame)
    on.let("fundamentals_table", made_data.fundamentals)
    on.let("modes_dataset", lambda racket, strung: made_data.modes())
    on.let("string_bed_coupling", lambda racket: made_data.coupling())
    on.let("grip_sweep", made_data.grip)
    on.check(frame.frame_modes, "frame_modes")


def test_impact_hammer(stand: Any) -> None:
    on = stand(frame)
    on.let("hammer_dataset", lambda racket, direction, pulse: made_data.strike())
    on.let("analyse_ringing", lambda signal, start: made_data.ringing(100.0 + 1e4 * start))
    mode = SimpleNamespace(ringing_per_impulse=lambda place: 3.0 * place + 0.1, node=0.2)
    on.let("bending_mode", lambda racket, direction: mode)
    on.check(frame.impact_hammer, "impact_hammer")


def test_inertia_bench(stand: Any) -> None:
    on = stand(frame)
    on.let("inertia_dataset", made_data.bench)
    on.let("swing_history", lambda racket: made_data.swing())
    on.check(frame.inertia_bench, "inertia_bench")


def test_frame_and_hand(stand: Any) -> None:
    """Impacts give a number that follows from what was asked; modes are as stiff as the joint."""
    on = stand(hand)

    def simulated(scenario: dr.Scenario, history: bool) -> SimpleNamespace:
        resolve(scenario)
        return outcome(0.3 + 0.01 * len(on.asked) + 0.001 * scenario.speed)

    def modes(system: dict[str, Any]) -> SimpleNamespace:
        stiffness, damping = system["racket"].throat_joint.out_of_plane()
        first = 4.0 * stiffness**0.5 * (1.0 if system["support"] == "free" else 0.9)
        frequencies = np.array([first, first + 30.0, 300.0, 290.0])
        return SimpleNamespace(
            frequencies=frequencies,
            damped_frequencies=0.99 * frequencies,
            damping_ratios=np.array([1.0, 2.0, 3.0, 4.0]) * damping / stiffness,
            strain_shares=np.array([[0.1, 0.8], [0.7, 0.2], [0.0, 0.9], [0.0, 0.3]]),
            elements=("in_plane", "out_of_plane"),
            bending=lambda plane: {"out_of_plane": 1}[plane],
        )

    on.let("simulate", simulated)
    on.patch.setattr(
        hand,
        "modal_system",
        lambda racket, support="free", grip=None: {"racket": racket, "support": support},
    )
    on.patch.setattr(hand, "solve_modes", modes)
    on.check(hand.frame_and_hand, "frame_and_hand")


def test_head_clamped(stand: Any) -> None:
    on = stand(impacts)
    on.let("normal_impacts", lambda **_: made_data.normal())
    on.let("make_sweep", lambda scenario, axes, outputs: (scenario, axes, outputs))
    drops = xarray.Dataset({"restitution": ("racket", [0.7, 0.72])}, {"racket": made_data.RACKETS})
    on.let("run_grid", lambda sweep, title: drops)
    on.let("simulate", lambda scenario, history: outcome(0.5 + 0.01 * len(on.asked)))
    on.check(impacts.head_clamped, "head_clamped")


def test_oblique(stand: Any) -> None:
    on = stand(impacts)
    on.let("oblique_impacts", lambda **_: made_data.oblique())
    on.check(impacts.oblique, "oblique")


def test_moving_racket(stand: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    on = stand(impacts)
    parts: list[Any] = []
    on.let("part_of", lambda report, done, total: parts.append((done, total)))
    on.let("restitution_map", lambda **_: made_data.supports())
    on.let("along_axis", lambda offsets, **_: made_data.axis())
    monkeypatch.setattr(
        "drake_racket.rigs.modes.shapes.head_node", lambda racket: racket.point(5)[0] - 0.03
    )
    on.check(impacts.moving_racket, "moving_racket")


def test_static_stiffness(stand: Any) -> None:
    on = stand(impacts)
    on.let("stiffness_dataset", lambda points, forces: made_data.pressed())
    on.let("mean_difference", lambda dataset: made_data.matches())
    on.check(impacts.static_stiffness, "static_stiffness")


@pytest.mark.parametrize("name", ["whole", "coarse"])
def test_spin(stand: Any, name: str) -> None:
    """Spin after follows from mu and support; whether the grid is fine, from the plan."""
    on = stand(spin)

    def simulated(scenario: dr.Scenario, history: bool) -> SimpleNamespace:
        mu = scenario.overrides["racket.friction.coefficients.mu2"]
        size = 1000.0 * mu * (0.9 if scenario.support == "grip" else 1.0)
        return SimpleNamespace(spin_after=size * scenario.spin_axis())

    def over(incidences: Any, frictions: Any = (0.25, 0.4), **_: Any) -> xarray.Dataset:
        grid = {"friction": list(frictions), "incidence": [float(i) for i in incidences]}
        over = "friction incidence"
        return made_data.made(
            grid,
            spin=(over, 0.0, 4000.0),
            angle=(over, 0.0, 60.0),
            sliding=(over, 0.0, 1.0),
            restitution=(over, 0.5, 0.8),
        )

    on.let("simulate", simulated)
    on.let("spin_over_incidence", over)
    for limit, at in (("slip_limit", 100.0), ("rolling_limit", 120.0)):
        on.let(limit, lambda mu, at=at: at * mu)
    on.let("rigid_slip_limit", lambda mu, restitution, factor: 50.0 * mu + restitution + factor)
    on.check(spin.spin, f"spin_{name}", Plan() if name == "whole" else Plan.coarse())


def test_plans() -> None:
    every = (1.0, *(50.0 * n for n in range(1, 25)))
    speeds = tuple(float(v) for v in range(18, 34, 3))
    assert Plan() == Plan(tuple(range(1, 10)), speeds, 0.01, every, 1)
    few = Plan((2, 4, 5, 7, 8), (18.0, 33.0), 0.07, (1.0, 400.0, 800.0, 1200.0), 1)
    assert Plan.coarse() == few
    assert Plan.coarse(4) == Plan(few.points, few.speeds, few.axis_step, few.forces, 4)
    assert set(few.settings()) == {"points", "speeds", "axis_step", "forces"}
