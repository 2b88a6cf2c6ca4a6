"""Active muscles of the shipped limb: torques, energy in both engines, and what is refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from drake_racket import (
    InputError,
    IntegratorSettings,
    LimbSettings,
    Scenario,
    changed,
    load_scenario,
    load_upper_limb,
    make_impact_diagram,
    simulate,
)
from drake_racket.cases.case import resolve

BACKHAND = load_scenario("backhand")


def active(activation: float, base: Scenario = BACKHAND, **keys) -> Scenario:
    limb = dataclasses.replace(base.limb, activation=activation)
    return dataclasses.replace(base, limb=limb, **keys)


def test_springs_and_dampers_are_on_the_joints_about_the_posture():
    system = make_impact_diagram(active(0.5))
    root = system.create_context()
    context = system.plant.GetMyContextFromRoot(root)
    muscles, shipped = system.limb.muscles, load_upper_limb()
    assert [j.name() for j in muscles.joints] == system.limb.limb.joint_names()
    for joint, spring in zip(muscles.joints, muscles.springs, strict=True):
        own = shipped.joint(joint.name())
        assert spring.GetNominalAngle(context) == joint.get_angle(context)
        assert spring.GetStiffness(context) == 0.5 * own.active_stiffness.value
        assert joint.GetDamping(context) == 0.5 * own.active_damping.value
    other = system.create_context(active(0.25))  # a Context's number
    context = system.plant.GetMyContextFromRoot(other)
    assert muscles.springs[0].GetStiffness(context) == 15.0
    assert resolve(active(0.0)).topology != resolve(active(0.25)).topology


def test_hold_holds_with_the_damper_in_place():
    """The joints do not accelerate at the start, whatever the activation."""
    for activation in (0.0, 1.0):
        system = make_impact_diagram(active(activation))
        root = system.create_context()
        rates = system.plant.EvalTimeDerivatives(system.plant.GetMyContextFromRoot(root))
        velocities = system.limb.limb.velocity_indices()
        found = rates.get_generalized_velocity().CopyToVector()[velocities]
        assert np.abs(found).max() < 1e-6


@pytest.mark.parametrize("engine", [pytest.param("drake", marks=pytest.mark.slow), "compiled"])
def test_energy_with_active_muscles(engine):
    scenario = active(
        1.0,
        engine=engine,
        after=0.01 if engine == "compiled" else 0.002,
        point="6",
        integrator=IntegratorSettings(accuracy=1e-7),
    )
    result = simulate(scenario, history=False)
    assert result.energy_error < 1e-6
    assert result.balance.lost_limb > 1e-4


def test_the_engines_agree():
    scenario = active(0.5, after=0.008, point="6")
    one, two = (simulate(scenario, engine=engine) for engine in ("drake", "compiled"))
    assert two.rebound_velocity == pytest.approx(one.rebound_velocity, abs=1e-3)
    wrist = [
        r.history["joint_position"].sel(joint="wrist_flexion").to_numpy()[-1] for r in (one, two)
    ]
    assert wrist[1] == pytest.approx(wrist[0], abs=1e-5)


def test_active_muscles_resist_forced_wrist_flexion():
    """A ball below the long axis flexes the wrist less, and leaves as fast."""

    def forced(activation: float):
        runs = [
            simulate(active(activation, engine="compiled", after=0.03, point=point))
            for point in ("5", "6")
        ]
        time = np.linspace(0.0, 0.03, 100)
        centre, below = (
            np.interp(
                time,
                run.history["time"],
                run.history["joint_position"].sel(joint="wrist_flexion"),
            )
            for run in runs
        )
        return np.degrees(np.max(below - centre)), runs[1].apparent_restitution

    relaxed, speed = forced(0.0)
    tense, same = forced(1.0)
    assert relaxed > 40.0
    assert 11.0 < tense < 32.0  # King, Hau & Blenkinsop 2016
    assert same == pytest.approx(speed, abs=1e-3)


def test_what_has_no_known_muscles_is_refused():
    with pytest.raises(InputError, match=r"limb\.activation: got 0\.5; allowed: 0 with another"):
        changed(
            Scenario(support="limb", limb=LimbSettings(model="arm.sdf", activation=0.5)), speed=20.0
        )
    with pytest.raises(InputError, match="0 to 1"):
        changed(active(1.5), speed=20.0)
    with pytest.raises(InputError, match=r"limb\.activation: got 0\.5; allowed: 0 with a limb of"):
        make_impact_diagram(active(0.5), limb=own_limb)


def own_limb(plant):
    from drake_racket import add_upper_limb

    return add_upper_limb(plant)
