"""Where the energy and the momentum are: a meter for what is lost, an audit of the rest.

What is lost is integrated beside the motion by `EnergyMeter`, at the integrator's own order, so
that the balance closes as well as the motion is solved. What is there is computed from the state.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import Context

from drake_racket.io.errors import InputError
from drake_racket.limbs.power import (
    LOST_JOINTS,
    LOST_LIMITS,
    TORQUE_WORK,
    joint_energy,
    limb_potential,
)
from drake_racket.plant.compose import Impact
from drake_racket.plant.systems.energy_meter import (
    COUPLE,
    GRIP,
    IMPULSE,
    LOST_BALL,
    LOST_FRICTION,
    LOST_JOINT,
    LOST_STRINGS,
)

if TYPE_CHECKING:
    from drake_racket.limbs.striking import StrikingLimb


@dataclass(frozen=True)
class RigidMotion:
    """The motion of the rigid body with the racket's present mass distribution and momentum."""

    mass: float  # kg
    velocity: NDArray[np.float64]  # of the centre of mass, in the world (m/s)
    angular_velocity: NDArray[np.float64]  # in the world (rad/s)
    kinetic_energy: float  # J


@dataclass(frozen=True)
class Balance:
    """Energies (J) and momenta (N s; N m s about the world's origin) at one instant.

    ball: kinetic. contact: stored in the compressed ball. rigid_motion: of the racket as one rigid
    body with its momentum (0 if clamped). bending: stored at the joint, and the frame's kinetic
    energy beyond the rigid motion. strings: stored, and kinetic relative to the head. gravity:
    potential of racket and ball. grip: gone into a hand's springs and dampers. limb: kinetic,
    potential, and stored at its joints' limits; torque_work: done by its joint torques. lost_*:
    given up so far; lost_ball includes what compression was left at release. couple: gained from
    forces that act along different lines.
    """

    ball: float
    contact: float
    rigid_motion: float
    bending: float
    strings: float
    gravity: float
    grip: float
    limb: float
    torque_work: float
    lost_limb: float
    lost_ball: float
    lost_friction: float
    lost_joint: float
    lost_strings: float
    couple: float
    linear_momentum: NDArray[np.float64]
    angular_momentum: NDArray[np.float64]
    ball_momentum: NDArray[np.float64]
    impulse_on_ball: NDArray[np.float64]

    def total(self) -> float:
        """Constant if the run is exact."""
        return (
            self.ball
            + self.contact
            + self.rigid_motion
            + self.bending
            + self.strings
            + self.gravity
            + self.grip
            + self.limb
            + self.lost_limb
            - self.torque_work
            + self.lost_ball
            + self.lost_friction
            + self.lost_joint
            + self.lost_strings
            - self.couple
        )


def rigid_motion(impact: Impact, plant_context: Context) -> RigidMotion:
    """The racket's rigid motion: v = P / m, w = I^-1 L about the centre of mass."""
    racket = impact.racket
    plant, instances = racket.plant, [racket.model_instance]
    mass = plant.CalcTotalMass(plant_context, instances)
    com = plant.CalcCenterOfMassPositionInWorld(plant_context, instances)
    momentum = plant.CalcSpatialMomentumInWorldAboutPoint(plant_context, instances, com)
    inertia = plant.CalcSpatialInertia(
        plant_context, plant.world_frame(), plant.GetBodyIndices(racket.model_instance)
    )
    moments = inertia.Shift(com).CalcRotationalInertia().CopyToFullMatrix3()
    w = np.linalg.solve(moments, momentum.rotational())
    v = momentum.translational() / mass
    energy = 0.5 * float(momentum.translational() @ v + momentum.rotational() @ w)
    return RigidMotion(mass, v, w, energy)


def balance(
    impact: Impact,
    meter: Any,
    root: Context,
    *,
    held: bool,
    limb: StrikingLimb | None = None,
) -> Balance:
    """The balance of one racket and one ball at the state of `root`.

    Args:
        meter: the EnergyMeter of the impact; its totals are what is lost so far.
        held: the racket is welded to the world; its rigid motion then counts as bending.
        limb: that holds the racket.

    Raises:
        InputError: the impact has no ball.

    """
    racket, ball = impact.racket, impact.ball
    if ball is None or impact.contact is None:
        raise InputError("balance: impact", "without a ball", "an impact with a ball")
    plant = racket.plant
    context = plant.GetMyContextFromRoot(root)
    both = [racket.model_instance, ball.model_instance]
    origin = np.zeros(3)
    v_ball = ball.body.EvalSpatialVelocityInWorld(context)
    ball_momentum = ball.body.get_mass(context) * v_ball.translational()
    momentum = plant.CalcSpatialMomentumInWorldAboutPoint(context, both, origin)
    ball_energy = _kinetic_energy(context, [ball.body])
    rigid = 0.0 if held else rigid_motion(impact, context).kinetic_energy
    rates = np.array([j.get_translation_rate(context) for j in racket.string_joints])
    masses = np.array([b.get_mass(context) for b in racket.string_masses])
    string_motion = 0.5 * float(masses @ (rates * rates))
    kinetic = _kinetic_energy(context, [b for b in racket.bodies() if b.get_mass(context)])
    stiffness = racket.bushing.GetTorqueStiffnessConstants(context)
    angles = racket.out_of_plane.get_angle(context), racket.in_plane.get_angle(context)
    stored = 0.5 * float(stiffness[1] * angles[0] ** 2 + stiffness[2] * angles[1] ** 2)
    bed = impact.string_bed
    strings = bed.GetOutputPort("energy").Eval(bed.GetMyContextFromRoot(root))[0]
    contact_context = impact.contact.GetMyContextFromRoot(root)
    contact = impact.contact.GetOutputPort("stored_energy").Eval(contact_context)[0]
    record = impact.record(root)
    totals = meter.GetOutputPort("totals").Eval(meter.GetMyContextFromRoot(root))
    gravity = plant.gravity_field().gravity_vector()
    com = plant.CalcCenterOfMassPositionInWorld(context, both)
    return Balance(
        ball=ball_energy,
        contact=float(contact),
        rigid_motion=rigid,
        bending=stored + kinetic - rigid - string_motion,
        strings=float(strings) + string_motion,
        gravity=-plant.CalcTotalMass(context, both) * float(gravity @ com),
        grip=float(totals[GRIP]),
        **_limb_energies(limb, root),
        lost_ball=float(totals[LOST_BALL]) + record.energy_given_up,
        lost_friction=float(totals[LOST_FRICTION]),
        lost_joint=float(totals[LOST_JOINT]),
        lost_strings=float(totals[LOST_STRINGS]),
        couple=float(totals[COUPLE]),
        linear_momentum=momentum.translational(),
        angular_momentum=momentum.rotational(),
        ball_momentum=ball_momentum,
        impulse_on_ball=totals[IMPULSE].copy(),
    )


def _limb_energies(limb: StrikingLimb | None, root: Context) -> dict[str, float]:
    if limb is None:
        return {"limb": 0.0, "torque_work": 0.0, "lost_limb": 0.0}
    plant = limb.limb.plant
    context = plant.GetMyContextFromRoot(root)
    energy = _kinetic_energy(context, limb.bodies)
    energy += limb_potential(limb.limb, plant, context) + joint_energy(limb.limb, plant, context)
    if limb.limits is not None:
        port = limb.limits.GetOutputPort("energy")
        energy += float(port.Eval(limb.limits.GetMyContextFromRoot(root))[0])
    assert limb.energy is not None
    totals = limb.energy.get_output_port().Eval(limb.energy.GetMyContextFromRoot(root))
    return {
        "limb": energy,
        "torque_work": float(totals[TORQUE_WORK]),
        "lost_limb": float(totals[LOST_JOINTS] + totals[LOST_LIMITS]),
    }


def _kinetic_energy(context: Context, bodies: Iterable[RigidBody]) -> float:
    """Kinetic energy (J) of some bodies: sum of V . (M V) / 2 about their own origins."""
    total = 0.0
    for body in bodies:
        velocity = body.EvalSpatialVelocityInWorld(context)
        inertia = body.CalcSpatialInertiaInBodyFrame(context).ReExpress(
            body.EvalPoseInWorld(context).rotation()
        )
        total += 0.5 * float(velocity.get_coeffs() @ (inertia * velocity).get_coeffs())
    return total
