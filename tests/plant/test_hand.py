"""A hand that has mass: what it adds, its energy in both engines, and what is refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant

from drake_racket import (
    HANDS,
    InputError,
    IntegratorSettings,
    Scenario,
    load_grip,
    load_racket,
    make_impact_diagram,
    simulate,
    write_grip,
)
from drake_racket.cases.case import resolve
from drake_racket.parameters.grip import check_grip
from drake_racket.plant.supports import add_hand_held_racket
from drake_racket.rigs.modes.modal_analysis import modal_system, solve_modes
from studies.hand_presets import FREE, HELD, bending, racket_like

BASE = Scenario(support="grip", grip="hand_medium", grip_kind="hand", after=0.006)


def test_the_hand_is_one_body_with_its_mass_on_the_handle():
    plant = MultibodyPlant(0.0)
    grip = load_grip("hand_tight")
    racket, held = add_hand_held_racket(plant, load_racket(), grip, kind="hand")
    plant.Finalize()
    context = plant.CreateDefaultContext()
    held.rest(context)
    assert held.body.get_mass(context) == grip.hand.mass.value == 0.445
    place = held.racket_frame.CalcPoseInWorld(context).translation()
    assert place.tolist() == [0.06, 0.0, 0.0]
    hand = held.hand_frame.CalcPoseInWorld(context).translation()
    assert hand.tolist() == [0.06, 0.0, 0.0]
    moments = held.body.CalcSpatialInertiaInBodyFrame(context).CalcRotationalInertia()
    assert moments.get_moments() == pytest.approx(grip.hand.moments.value, rel=1e-14)
    rates = plant.EvalTimeDerivatives(context).CopyToVector()
    gravity = plant.gravity_field().gravity_vector()[2]
    assert gravity < 0.0
    assert np.count_nonzero(np.abs(rates) > 1e-9) == 2  # both fall, unstrained
    assert len(racket.segments) == 2


@pytest.mark.parametrize("plane", ["in_plane", "out_of_plane"])
def test_a_hand_with_mass_lowers_the_bending(plane):
    free = solve_modes(modal_system(load_racket()))
    modes = solve_modes(modal_system(load_racket(), support="grip", grip=load_grip("hand_tight")))
    ratio = modes.frequencies[modes.bending(plane)] / free.frequencies[free.bending(plane)]
    assert 0.85 < ratio < 0.95
    assert np.sum(modes.strain_shares, axis=1) == pytest.approx(1.0, abs=1e-8)
    assert modes.rigid_motions == 0


@pytest.mark.parametrize("engine", [pytest.param("drake", marks=pytest.mark.slow), "compiled"])
def test_energy_of_racket_ball_and_hand(engine):
    tight = IntegratorSettings(accuracy=1e-8)
    scenario = dataclasses.replace(
        BASE,
        engine=engine,
        gravity=(0.0, 0.0, -9.81),
        after=0.006 if engine == "compiled" else 0.0015,
        integrator=tight,
        offset_y=0.04,
        overrides={"racket.frame.segments": 4},
    )
    result = simulate(scenario, history=False)
    assert result.energy_error < 1e-6
    assert result.balance.grip > 1e-3


@pytest.mark.slow
def test_both_engines_and_the_shared_context_agree():
    scenario = dataclasses.replace(BASE, integrator=IntegratorSettings(accuracy=1e-6))
    other = dataclasses.replace(
        scenario, overrides={"grip.hand.mass": 0.8, "grip.hand.wrist_force_stiffness.z": 5e4}
    )
    assert resolve(other).topology == resolve(scenario).topology
    system = make_impact_diagram(scenario)
    one = simulate(other, system, engine="drake")
    two = simulate(other, engine="compiled")
    assert two.rebound_velocity == pytest.approx(one.rebound_velocity, abs=1e-5)
    plain = simulate(scenario, engine="compiled")
    assert abs(plain.rebound_velocity[2] - two.rebound_velocity[2]) > 2e-4
    forces = [np.abs(r.history["hand_force"].sel(axis="z")).max().item() for r in (one, two)]
    assert forces[1] == pytest.approx(forces[0], rel=1e-3)


def test_on_a_limb_the_hand_is_the_limbs_own():
    """No mass twice: the palm's springs alone."""
    case = dataclasses.replace(BASE, support="limb")
    system = make_impact_diagram(case)
    assert system.grip.body is None
    assert system.grip.wrist_side() is None
    compliant = make_impact_diagram(dataclasses.replace(case, grip_kind="compliant"))
    masses = []
    for made in (system, compliant):
        plant = made.plant
        masses.append(plant.CalcTotalMass(plant.CreateDefaultContext()))
        bushing = made.grip.bushing.force_stiffness_constants()
        assert bushing.tolist() == list(load_grip("hand_medium").force_stiffness.value)
    assert masses[0] == masses[1]


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"grip": "normal"}, "grip: got 'normal'; allowed: with grip_kind hand a grip whose hand"),
        (
            {"grip_kind": "compliant", "overrides": {"grip.hand.mass": 1.0}},
            "a hand's mass and wrist with grip_kind hand alone",
        ),
        (
            {"support": "limb", "overrides": {"grip.hand.mass": 1.0}},
            "the palm's numbers: a limb's own hand has mass",
        ),
        ({"overrides": {"grip.hand.mass": 0.0}}, "got 0.0; allowed: more than 0"),
        ({"overrides": {"grip.hand.moments.x": 0.1}}, "no moment above the others' sum"),
    ],
)
def test_what_no_hand_is_is_refused_on_one_line(keys, message):
    with pytest.raises(InputError, match=message) as caught:
        resolve(dataclasses.replace(BASE, **keys))
    assert "\n" not in str(caught.value)


def test_a_hands_file(tmp_path):
    grip = load_grip("hand_light")
    write_grip(grip, tmp_path / "mine.yaml")
    assert load_grip(tmp_path / "mine.yaml") == grip
    write_grip(load_grip("loose"), tmp_path / "plain.yaml")
    assert "hand:" not in (tmp_path / "plain.yaml").read_text()
    two = dataclasses.replace(grip.hand.moments, value=(1e-3, 1e-3))
    short = dataclasses.replace(grip, hand=dataclasses.replace(grip.hand, moments=two))
    with pytest.raises(InputError, match="allowed: at least 3 numbers"):
        check_grip(short)


@pytest.mark.parametrize("name", HANDS)
def test_the_presets_are_the_measured_hands(name):
    """Frequency ratios to 2 percentage points, dampings to 25 %, of both of Savage's rackets."""
    grip = load_grip(name)
    for racket in FREE:
        frequency, damping = bending(racket_like(racket), grip)
        free, (measured, damped) = FREE[racket], HELD[name][racket]
        assert frequency / free[0] == pytest.approx(measured / free[0], abs=0.02)
        assert damping == pytest.approx(damped, rel=0.25)
