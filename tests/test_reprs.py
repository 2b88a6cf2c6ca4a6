"""What handles and parameters show of themselves: one short line with their name."""

from __future__ import annotations

import dataclasses

import pytest
from pydrake.multibody.plant import MultibodyPlant

import drake_racket as dr
from drake_racket.cases.case import SCENARIOS
from drake_racket.sweep import make_sweep

HELD = dr.make_impact_diagram(dr.Scenario(support="grip", grip_kind="torsional", speed=30.0))
IN_LIMB = dr.make_impact_diagram(dr.load_scenario(SCENARIOS[0]))
RACKET = dr.load_racket("tour", "low")
LONG = dr.Scenario(overrides={f"racket.string_bed.stiffness.k{i}": 1e5 for i in range(1, 5)})

SHOWN = [
    (RACKET, "RacketParameters(tour_low: Head LM Prestige (tour), strung at 254 N)"),
    (dr.load_ball(), "BallParameters(penn_titanium: Pro Penn Titanium)"),
    (dr.load_grip("loose"), "GripStiffness(loose: "),
    (dr.load_upper_limb(), "UpperLimbParameters(upper_limb: "),
    (RACKET.handle.mass, f"{RACKET.handle.mass.value} kg (printed)"),
    (dr.load_ball().stiffness_growth, "0.52 (printed)"),
    (dr.load_grip().force_stiffness, "[30000.0, 30000.0, 30000.0] N/m (inferred)"),
    (dr.Scenario(), "Scenario()"),
    (dr.Scenario(support="grip", speed=30.0), "Scenario(support='grip', speed=30.0)"),
    (
        dr.Scenario(integrator=dr.IntegratorSettings(accuracy=0.01)),
        "Scenario(integrator=IntegratorSettings(accuracy=0.01))",
    ),
    (LONG, "Scenario(overrides={'racket.string_bed.stiffness.k1': 100000.0, "),
    (
        dr.Scenario(limb=dr.LimbSettings(stroke=dr.Stroke(speed=12.0))),
        "Scenario(limb=LimbSettings(stroke=Stroke(speed=12.0)))",
    ),
    (HELD.impact.racket, "Racket(racket: tour_low, 9 string masses)"),
    (HELD.impact.ball, "Ball(ball: penn_titanium)"),
    (HELD.grip, "Grip(torsional: "),
    (
        HELD.impact,
        "Impact(Racket(racket: tour_low, 9 string masses), Ball(ball: penn_titanium))",
    ),
    (
        HELD,
        "ImpactDiagram(Scenario(support='grip', grip_kind='torsional', speed=30.0))",
    ),
    (IN_LIMB, "ImpactDiagram(Scenario("),
    (IN_LIMB.limb, "StrikingLimb(Limb(upper_limb: 7 joints, hand frame "),
    (
        make_sweep(dr.Scenario(), {"point": [2, 5, 8], "speed": {"values": [20], "unit": "m/s"}}),
        "Sweep(3 cases: point (3) x speed (1))",
    ),
]


@pytest.mark.parametrize(("thing", "text"), SHOWN, ids=lambda x: type(x).__name__)
def test_one_short_line_with_the_name(thing: object, text: str) -> None:
    line = repr(thing)
    assert line == text if text[-1] in ")" else line.startswith(text)
    assert len(line) <= 120
    assert len(line.splitlines()) == 1
    assert type(thing).__name__ in line or isinstance(thing, dr.Quantity) or line[0] == "["


def test_a_bare_frame_says_so() -> None:
    racket = dr.add_racket(MultibodyPlant(0.0), RACKET, name="mine", strung=False)
    assert repr(racket) == "Racket(mine: tour_low, not strung)"


def test_what_is_too_long_is_cut() -> None:
    long = dataclasses.replace(RACKET, title="x" * 500)
    assert repr(long).endswith("xxx...)")
    assert len(repr(long)) == 120
    many = dataclasses.replace(RACKET.string_bed.stiffness, value=(1e5,) * 100)
    assert repr(many).endswith("...] N/m (printed)")
