"""A racket in a hand: the load on the hand, the energy in the grip, and its two limits."""

from __future__ import annotations

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
import xarray
from pydrake.autodiffutils import AutoDiffXd, InitializeAutoDiff

from drake_racket import (
    InputError,
    IntegratorSettings,
    Scenario,
    make_impact_diagram,
    set_grip_load_parameters,
    simulate,
)
from drake_racket.parameters.grip import load_grip, write_grip
from tests.conftest import ROOT

STUDY = ROOT / "studies" / "grip_limits.py"
TIGHT = IntegratorSettings(accuracy=2e-6, maximum_step=5e-5)

HELD = Scenario(support="grip", point="4", incidence_deg=17.0, after=0.008)


@pytest.fixture(scope="module")
def result():
    return simulate(dataclasses.replace(HELD, integrator=TIGHT))


def test_energy_closes_with_the_grips_share(result):
    assert result.energy_error < 1e-6
    energy = result.history["energy"]
    assert float(energy.sel(store="grip")[-1]) > 1.0  # J: leaving it out would show
    assert result.momentum_error < 1e-10


def test_the_hands_load_is_what_momentum_lacks(result):
    """Force on the hand, integrated: the linear momentum that ball and racket lose."""
    history = result.history
    time = history["time"].to_numpy()
    force = history["hand_force"].to_numpy()
    impulse = np.trapezoid(force, time, axis=0)
    system = make_impact_diagram(HELD)
    mass = system.plant.CalcTotalMass(
        system.plant.CreateDefaultContext(), [system.impact.racket.model_instance]
    )
    ball = system.impact.ball.parameters.mass.value
    lost = (
        ball * (history["ball_velocity"][0] - history["ball_velocity"][-1]).to_numpy()
        - mass * result.racket_velocity
    )
    np.testing.assert_allclose(impulse, lost, atol=2e-5)
    assert np.linalg.norm(impulse) > 0.1


def test_the_first_load_is_the_spring_law_at_rest():
    """A racket displaced in the hand by d, not turned: force K d and no torque on the hand."""
    system = make_impact_diagram(HELD)
    root = system.create_context()
    grip = load_grip()
    plant = system.plant
    context = plant.GetMyMutableContextFromRoot(root)
    handle = system.impact.racket.handle
    pose = handle.EvalPoseInWorld(context)
    d = np.array([1e-3, -2e-3, 3e-3])
    pose.set_translation(pose.translation() + d)
    plant.SetFreeBodyPose(context, handle, pose)
    load = system.diagram.GetOutputPort("hand_load").Eval(root)
    np.testing.assert_allclose(load[3:], np.array(grip.force_stiffness.value) * d, rtol=1e-12)
    # the bushing's force acts halfway between the two frames: the couple is that of the offset
    np.testing.assert_allclose(load[:3], np.cross(0.5 * d, load[3:]), atol=1e-12)
    tight = load_grip("tight")
    system.grip.set_stiffness(root, tight)
    set_grip_load_parameters(system.grip_load, system.grip, root)
    load = system.diagram.GetOutputPort("hand_load").Eval(root)
    np.testing.assert_allclose(load[3:], np.array(tight.force_stiffness.value) * d, rtol=1e-12)


def test_restitution_goes_from_the_free_to_the_clamped_racket(tmp_path):
    """Monotonic in the grip's stiffness, at a corner, where the support matters most."""
    base = Scenario(point="1", after=0.006, audit=False)
    free, clamped = (
        simulate(dataclasses.replace(base, support=s), history=False).apparent_restitution
        for s in ("free", "clamped_handle")
    )
    held = dataclasses.replace(base, support="grip")
    system = make_impact_diagram(held)
    found = []
    for factor in (1e-6, 1.0, 1e2, 1e4):
        path = tmp_path / f"grip_{factor:g}.yaml"
        write_grip(load_grip().scaled(factor), path)
        case = dataclasses.replace(held, grip=str(path))
        found.append(simulate(case, system, history=False).apparent_restitution)
    assert found == sorted(found)
    assert found[0] == pytest.approx(free, abs=1e-5)  # the damping is a thousandth
    assert found[-1] == pytest.approx(clamped, abs=2e-3)
    assert found[1] - free < 0.01


def test_the_load_converts_to_autodiff():
    system = make_impact_diagram(dataclasses.replace(HELD, audit=False))
    root = system.create_context()
    twin = system.diagram.ToScalarType[AutoDiffXd]()
    twin_root = twin.CreateDefaultContext()
    twin_root.SetTimeStateAndParametersFrom(root)
    plant = twin.GetSubsystemByName("plant")
    context = plant.GetMyMutableContextFromRoot(twin_root)
    state = system.plant.GetPositionsAndVelocities(system.plant.GetMyContextFromRoot(root)).copy()
    place = 4 + 2  # z of the racket's free body
    state[place] = 1e-3
    derivative = InitializeAutoDiff(state)
    plant.SetPositionsAndVelocities(context, derivative[:, 0])
    load = twin.GetOutputPort("hand_load").Eval(twin_root)
    stiffness = load_grip().force_stiffness.value[2]
    assert load[5].value() == pytest.approx(1e-3 * stiffness)
    assert load[5].derivatives()[place] == pytest.approx(stiffness)


@pytest.mark.parametrize("kind", ["torsional", pytest.param("weld", marks=pytest.mark.slow)])
def test_the_load_of_a_joint_is_what_momentum_lacks(kind):
    """As for the compliant grip: the joint's reaction, summed, is the momentum that is gone."""
    case = dataclasses.replace(HELD, grip_kind=kind, integrator=TIGHT)
    system = make_impact_diagram(case)
    result = simulate(case, system)
    history = result.history
    time = history["time"].to_numpy()
    context = system.plant.CreateDefaultContext()
    mass = system.plant.CalcTotalMass(context, [system.impact.racket.model_instance])
    ball = system.impact.ball.parameters.mass.value
    lost = (
        ball * (history["ball_velocity"][0] - history["ball_velocity"][-1]).to_numpy()
        - mass * result.racket_velocity
    )
    impulse = np.trapezoid(history["hand_force"].to_numpy(), time, axis=0)
    np.testing.assert_allclose(impulse, lost, atol=2e-4)
    assert np.linalg.norm(impulse) > 0.1
    assert result.energy_error < 1e-6


def test_a_weld_to_a_fixed_hand_is_a_clamped_handle():
    case = dataclasses.replace(HELD, grip_kind="weld", audit=False)
    held = simulate(case, history=False)
    clamped = simulate(dataclasses.replace(case, support="clamped_handle"), history=False)
    np.testing.assert_allclose(held.rebound_velocity, clamped.rebound_velocity, rtol=1e-12)


def test_a_torsional_grip_holds_its_point():
    system = make_impact_diagram(dataclasses.replace(HELD, grip_kind="torsional"))
    result = simulate(dataclasses.replace(HELD, grip_kind="torsional"), system)
    grip = system.impact.racket.parameters.landmarks.grip.value
    butt = result.history["butt_position"].to_numpy()
    # the butt stays on a sphere about the grip's place
    distance = np.linalg.norm(butt - [grip, 0.0, 0.0], axis=1)
    np.testing.assert_allclose(distance, grip, rtol=1e-9)
    assert np.ptp(butt[:, 2]) > 1e-3


def test_a_written_grip_comes_back(tmp_path):
    grip = load_grip("tight").scaled(0.3)
    write_grip(grip, tmp_path / "mine.yaml")
    assert load_grip(str(tmp_path / "mine.yaml")) == grip


@pytest.mark.slow
def test_grip_limits_study(tmp_path):
    command = [sys.executable, str(STUDY), "--factors", "0.01", "1", "1000"]
    run = subprocess.run(
        [*command, "--out", str(tmp_path / "o")], capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    data = xarray.open_dataset(tmp_path / "o" / "grip_limits.nc", engine="h5netcdf")
    rotation = data["rotation"].to_numpy()
    assert list(data["factor"]) == [0.0, 0.01, 1.0, 1000.0, np.inf]
    assert np.all(np.diff(rotation) < 0.0)
    assert rotation[-1] == pytest.approx(0.0, abs=1e-12)
    assert float(data["rebound"][-2]) == pytest.approx(float(data["rebound"][-1]), abs=0.1)
    assert float(data["rebound"][1] - data["rebound"][0]) == pytest.approx(0.0, abs=0.02)
    wrong = subprocess.run([*command[:-1], "0.5"], capture_output=True, text=True, check=False)
    assert wrong.returncode == 2
    assert "--factors" in wrong.stderr


def test_presets_keep_the_damping_ratio_of_the_normal_grip():
    normal = load_grip()
    for name, factor in (("loose", 0.25), ("tight", 4.0)):
        grip, scaled = load_grip(name), normal.scaled(factor)
        for key in ("force_stiffness", "force_damping", "torque_stiffness", "torque_damping"):
            assert getattr(grip, key).value == pytest.approx(getattr(scaled, key).value)


def test_an_unknown_grip_is_refused():
    with pytest.raises(InputError, match="grip"):
        simulate(dataclasses.replace(HELD, grip="pinch"))
    with pytest.raises(InputError, match="grip_kind"):
        simulate(dataclasses.replace(HELD, grip_kind="glue"))
