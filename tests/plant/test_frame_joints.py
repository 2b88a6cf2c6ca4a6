"""The frame's joints are data: those of the paper's racket, and one more about x."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from drake_racket import InputError, add_ball, add_energy_meter, add_impact, add_racket, load_racket
from drake_racket.parameters.ball import load_ball
from drake_racket.parameters.frame import FrameJoint, bushing_constants
from drake_racket.parameters.racket import RacketParameters
from drake_racket.plant.systems.energy_meter import LOST_JOINT, set_meter_parameters
from drake_racket.rigs.modes.modal_analysis import modal_system, solve_modes


class Twisting(RacketParameters):
    """A racket whose head also twists against its handle."""

    def frame_joints(self) -> tuple[FrameJoint, ...]:
        place = self.handle.length.value
        return (*super().frame_joints(), FrameJoint("torsion", "x", place, 300.0, 0.05))


def twisting() -> Twisting:
    racket = load_racket()
    return Twisting(**{f.name: getattr(racket, f.name) for f in fields(racket)})


def test_the_papers_joints():
    joints = load_racket("tour").frame_joints()
    assert joints == (
        FrameJoint("in_plane", "z", 0.356, 1650.0, 0.09),
        FrameJoint("out_of_plane", "y", 0.356, 910.0, 0.03),
    )
    assert bushing_constants(joints) == ([0.0, 910.0, 1650.0], [0.0, 0.03, 0.09])
    printed = load_racket("tour", joint_reading="as_printed").frame_joints()
    assert [joint.stiffness for joint in printed] == [910.0, 1650.0]


def test_handles_by_name_and_in_order():
    plant = MultibodyPlant(0.0)
    racket = add_racket(plant, load_racket())
    assert racket.frame_joints == (racket.in_plane, racket.out_of_plane)
    assert racket.frame_joint("out_of_plane").revolute_axis().tolist() == [0.0, 1.0, 0.0]
    with pytest.raises(InputError, match="'torsion'; allowed: in_plane, out_of_plane"):
        racket.frame_joint("torsion")


def test_constants_of_a_context_are_read_and_written():
    plant = MultibodyPlant(0.0)
    racket = add_racket(plant, load_racket())
    plant.Finalize()
    context = plant.CreateDefaultContext()
    own = racket.parameters.frame_joints()
    assert racket.joint_constants() == racket.joint_constants(context) == own
    changed = (own[0], replace(own[1], stiffness=700.0, damping=0.2))
    racket.set_joint_constants(context, changed)
    assert racket.joint_constants(context) == changed
    assert racket.joint_constants() == own


ANGLES, RATES = (0.3, -0.4, 0.2), (2.0, -5.0, 3.0)


def bent(racket, plant, context) -> None:
    for joint, angle, rate in zip(racket.frame_joints, ANGLES, RATES, strict=True):
        joint.set_angle(context, angle)
        joint.set_angular_rate(context, rate)


def test_every_joint_has_its_own_torque():
    """tau = -k q - c q' on each of three, at large angles too."""
    plant = MultibodyPlant(0.0)
    racket = add_racket(plant, twisting(), strung=False)
    plant.Finalize()
    assert plant.num_velocities() == 6 + 3
    assert [joint.name() for joint in racket.frame_joints] == [
        "in_plane",
        "out_of_plane",
        "torsion",
    ]
    context = plant.CreateDefaultContext()
    bent(racket, plant, context)
    plain = context.Clone()
    loose = [replace(j, stiffness=0.0, damping=0.0) for j in racket.parameters.frame_joints()]
    racket.set_joint_constants(plain, loose)
    with_torque, without = (
        plant.EvalTimeDerivatives(c).get_generalized_velocity().CopyToVector()
        for c in (context, plain)
    )
    torque = plant.CalcMassMatrix(context) @ (with_torque - without)
    expected = np.zeros(plant.num_velocities())
    constants = ((1650.0, 0.09), (910.0, 0.03), (300.0, 0.05))
    for joint, (k, c), angle, rate in zip(
        racket.frame_joints, constants, ANGLES, RATES, strict=True
    ):
        expected[joint.velocity_start()] = -k * angle - c * rate
    assert torque == pytest.approx(expected, abs=1e-7)


def test_the_meter_sums_over_all_joints():
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    racket = add_racket(plant, twisting())
    ball = add_ball(plant, load_ball())
    impact = add_impact(builder, plant, racket, ball)
    meter = add_energy_meter(builder, plant, impact)
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(root)
    bent(racket, plant, context)

    def lost() -> float:
        rates = meter.EvalTimeDerivatives(meter.GetMyContextFromRoot(root))
        return rates.get_vector()[LOST_JOINT]

    squares = np.square(RATES)
    assert lost() == pytest.approx(np.dot([0.09, 0.03, 0.05], squares), rel=1e-12)
    joints = racket.joint_constants(context)
    racket.set_joint_constants(context, [*joints[:2], replace(joints[2], damping=0.4)])
    set_meter_parameters(meter, impact, root)
    assert lost() == pytest.approx(np.dot([0.09, 0.03, 0.4], squares), rel=1e-12)


def test_modes_name_the_joint_that_bends():
    modes = solve_modes(modal_system(twisting(), strung=False))
    assert modes.elements == ("in_plane", "out_of_plane", "torsion", "string_bed", "grip")
    assert sorted(modes.kinds) == ["in_plane", "out_of_plane", "torsion"]
    twist = modes.bending("torsion")
    # about x the two parts turn against each other: f = sqrt(k (1/I1 + 1/I2)) / 2 pi
    racket = load_racket()
    inertias = [part.moi_longitudinal.value for part in (racket.handle, racket.head)]
    expected = np.sqrt(300.0 * sum(1.0 / i for i in inertias)) / (2.0 * np.pi)
    assert modes.frequencies[twist] == pytest.approx(expected, rel=1e-6)
