"""Muscles act during an impact as torques on a limb's joints, constant or a user's own.

An impact lasts about 5 ms, less than a reflex takes: constant torques stand for muscles that do not
answer it. Three choices for them, from `initial_torques`, at the state before the impact:

- `zero`: no torque at all.
- `hold`: the joints do not accelerate at the instant they are taken: with everything else free to
  move (throat joints, string masses, a racket in a compliant grip, a ball) under the forces that
  act in that state, v'_L = 0 for the limb's joints. A grip that is not yet strained puts no load on
  the hand, and a frame that is not yet bent none of the head's weight: `hold` then leaves them out.
- `carry`: the same with the racket locked to the hand as one rigid body, so that the torques bear
  the racket's weight and the force that keeps it on its path. What a throat, string-bed and grip
  that have settled ask for.

Muscles that are active answer at once, before any reflex, by their stiffness and the slope of force
over velocity. On the shipped limb `Muscles` have that as a spring about the posture at the start
and a damper on each joint, in proportion to one activation a, beside the torques above:

    tau = tau_0 - a k (q - q_0) - a d q'.

With `hold` or `carry` tau_0 is found with the damper in place, so that it resists changes of the
stroke's rates alone. The springs' posture does not move on with the stroke: over 10 ms at 10 rad/s
that is 0.1 rad. They are Drake's own elements, so that engines, energy and logs have them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    JacobianWrtVariable,
    JointActuator,
    MultibodyForces,
    RevoluteJoint,
    RevoluteSpring,
)
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort
from pydrake.systems.primitives import ConstantVectorSource, MatrixGain

from drake_racket.io.errors import InputError
from drake_racket.limbs.limb import Limb
from drake_racket.parameters.limb import UpperLimbParameters
from drake_racket.parameters.limb_settings import JOINT_TORQUES
from drake_racket.parameters.stroke import Vector
from drake_racket.plant.racket import Racket


def initial_torques(
    kind: str, plant: MultibodyPlant, context: Context, limb: Limb, racket: Racket
) -> Vector:
    """Computes joint torques (n,) at the state of the plant's `context`, in the order of v.

    Raises:
        InputError: unknown kind.

    """
    if kind not in JOINT_TORQUES:
        raise InputError("joint torques", kind, ", ".join(JOINT_TORQUES))
    if kind == "zero":
        return np.zeros(len(limb.velocity_indices()))
    if kind == "hold":
        return hold_torques(plant, context, limb)
    return carry_torques(plant, context, limb, racket)


def hold_torques(plant: MultibodyPlant, context: Context, limb: Limb) -> Vector:
    """Computes torques (n,) under which the limb's joints do not accelerate; all else is free.

    With M v' + b = S tau, b from inverse dynamics at v' = 0, and v'_L = 0, the others follow from
    M_RR v'_R = -b_R, and tau = M_LR v'_R + b_L. A joint that is tied to one of the limb's rests
    with it, and is held through its tie by the leader's torque.
    """
    ours = limb.velocity_indices()
    tied = [tie.follower.velocity_start() for tie in limb.ties]
    others = np.setdiff1d(np.arange(plant.num_velocities()), [*ours, *tied])
    bias = _inverse_dynamics(plant, context, np.zeros(plant.num_velocities()))
    M = plant.CalcMassMatrix(context)
    rates = np.linalg.solve(M[np.ix_(others, others)], -bias[others])
    forces = bias.copy()
    for held in (ours, tied):
        forces[held] = M[np.ix_(held, others)] @ rates + bias[held]
    return _through_ties(limb, forces)[ours]


def _through_ties(limb: Limb, forces: Vector) -> Vector:
    """The generalized forces (nv,) with those of tied joints given to the joints they follow."""
    if not limb.ties:
        return forces
    moved = forces.copy()
    for tie in limb.ties:
        follower = tie.follower.velocity_start()
        moved[tie.leader.velocity_start()] += tie.ratio * forces[follower]
        moved[follower] = 0.0
    return moved


def carry_torques(plant: MultibodyPlant, context: Context, limb: Limb, racket: Racket) -> Vector:
    """Computes torques (n,) under which limb and racket, rigid in the hand, do not accelerate.

    Inverse dynamics at v'_L = 0. For a racket that is a free body: with the acceleration of a body
    rigid in the hand, and the wrench that this takes put on the hand. The state must be one in
    which the racket moves with the hand (`apply_stroke`).
    """
    ours, handle = limb.velocity_indices(), racket.handle
    vdot = np.zeros(plant.num_velocities())
    if not handle.is_floating_base_body():
        return _through_ties(limb, _inverse_dynamics(plant, context, vdot))[ours]
    world, hand = plant.world_frame(), limb.hand
    p_HoBo = handle.body_frame().CalcPose(context, hand).translation()
    bias = plant.CalcBiasSpatialAcceleration(
        context, JacobianWrtVariable.kV, hand, p_HoBo, world, world
    )
    start = handle.floating_velocities_start_in_v()
    vdot[start : start + 6] = bias.get_coeffs()
    forces = _inverse_dynamics(plant, context, vdot)
    J = plant.CalcJacobianSpatialVelocity(
        context, JacobianWrtVariable.kV, hand, p_HoBo, world, world
    )
    forces[ours] = forces[ours] + J[:, ours].T @ forces[start : start + 6]
    return _through_ties(limb, forces)[ours]


def _inverse_dynamics(plant: MultibodyPlant, context: Context, vdot: Vector) -> Vector:
    """Generalized forces (nv,) for v' on top of gravity, bushings, and the joints' damping."""
    applied = MultibodyForces(plant)
    plant.CalcForceElementsContribution(context, applied)
    return np.asarray(plant.CalcInverseDynamics(context, vdot, applied), dtype=float)


@dataclass(frozen=True)
class JointTorques:
    """The JointTorques hold handles to the torques on a limb's joints.

    Attributes:
        limb: whose joints.
        source: holds the torques in its Context; None where they come from an exported input.
        selector: takes the torques (n,) to the plant's actuation or generalized forces.
        actuators: of the joints, in order, if the torques go to the plant's actuation port (which
            is then connected); empty if not: connect `generalized_force_port` with
            `plant.compose.connect_forces`.

    """

    limb: Limb
    source: ConstantVectorSource | None
    selector: MatrixGain
    actuators: tuple[JointActuator, ...]

    def set(self, root: Context, torques: Vector) -> None:
        """Writes constant torques (n,) in N m into the Context of the Diagram.

        Raises:
            InputError: the torques are a user's system, not n finite numbers, or beyond what an
                actuator gives (Drake would cut them off silently).

        """
        if self.source is None:
            raise InputError("JointTorques.set", "an exported input", "torques of its own")
        size = self.selector.get_input_port().size()
        if np.shape(torques) != (size,) or not np.isfinite(torques).all():
            raise InputError("JointTorques.set: torques", torques, f"{size} finite numbers")
        for actuator, torque in zip(self.actuators, torques, strict=False):
            limit = actuator.effort_limit()
            if abs(torque) > limit:
                raise InputError(
                    f"JointTorques.set: torque of {actuator.joint().name()}",
                    float(torque),
                    f"the actuator's {-limit:g} to {limit:g} N m",
                )
        context = self.source.GetMyMutableContextFromRoot(root)
        self.source.get_mutable_source_value(context).SetFromVector(torques)

    def generalized_force_port(self) -> OutputPort | None:
        """Gives the port for applied_generalized_force; None where the actuation takes them."""
        return None if self.actuators else self.selector.get_output_port()


def add_joint_torques(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    limb: Limb,
    *,
    name: str = "joint_torques",
    export: bool = False,
) -> JointTorques:
    """Adds a limb's joint torques (zero until set) to `builder`. After `plant.Finalize()`.

    They are the plant's actuation where every joint of the limb has an actuator, and generalized
    forces otherwise; those share the plant's port with the string-bed, so connect them with
    `connect_forces(builder, plant, [impact], generalized=[torques.generalized_force_port()])`.

    Args:
        export: no constant source; the Diagram gets an input port `name` (n,) for a user's system.

    Raises:
        InputError: the plant is not finalized, or its actuation port is connected already.

    """
    if not plant.is_finalized():
        raise InputError("add_joint_torques: plant", "not finalized", "a plant after Finalize()")
    actuators = _actuators(plant, limb)
    size = len(limb.velocity_indices())
    if actuators:
        gain = np.zeros((plant.num_actuated_dofs(), size))
        gain[[a.input_start() for a in actuators], np.arange(size)] = 1.0
    else:
        gain = np.eye(plant.num_velocities())[:, limb.velocity_indices()]
    selector = builder.AddNamedSystem(f"{name}_selector", MatrixGain(gain))
    source = None
    if export:
        builder.ExportInput(selector.get_input_port(), name)
    else:
        source = builder.AddNamedSystem(name, ConstantVectorSource(np.zeros(size)))
        builder.Connect(source.get_output_port(), selector.get_input_port())
    if actuators:
        port = plant.get_actuation_input_port()
        if builder.IsConnectedOrExported(port):
            raise InputError(
                "add_joint_torques: the plant's actuation port", "connected already", "a free port"
            )
        builder.Connect(selector.get_output_port(), port)
    return JointTorques(limb, source, selector, actuators)


def _actuators(plant: MultibodyPlant, limb: Limb) -> tuple[JointActuator, ...]:
    """One actuator per joint of the limb, in order; none unless every joint has one."""
    every = [plant.get_joint_actuator(i) for i in plant.GetJointActuatorIndices()]
    by_joint = {actuator.joint().index(): actuator for actuator in every}
    found = tuple(by_joint[j.index()] for j in limb.joints if j.index() in by_joint)
    return found if len(found) == len(limb.joints) else ()


@dataclass(frozen=True)
class Muscles:
    """The muscles are springs on a limb's joints; their dampers are the joints' own.

    Attributes:
        joints, springs: in the order of the limb's joints.
        active: of each, stiffness (N m/rad) and damping (N m s/rad) at full activation.
        passive: damping (N m s/rad) of each joint without muscles.

    """

    joints: tuple[RevoluteJoint, ...]
    springs: tuple[RevoluteSpring, ...]
    active: Sequence[tuple[float, float]]
    passive: Sequence[float]

    def hold(self, plant: MultibodyPlant, context: Context, activation: float) -> None:
        """Lets the muscles hold the posture of the plant's `context`."""
        rows = zip(self.joints, self.springs, self.active, self.passive, strict=True)
        for joint, spring, (stiffness, damping), own in rows:
            spring.SetNominalAngle(context, joint.get_angle(context))
            spring.SetStiffness(context, activation * stiffness)
            joint.SetDamping(context, own + activation * damping)


def add_muscles(plant: MultibodyPlant, limb: Limb, shipped: UpperLimbParameters) -> Muscles:
    """Adds the springs of the shipped limb's muscles to `plant`, before `Finalize`."""
    joints = tuple(joint for joint in limb.joints if isinstance(joint, RevoluteJoint))
    springs = tuple(plant.AddForceElement(RevoluteSpring(joint, 0.0, 0.0)) for joint in joints)
    named = [shipped.joint(joint.name()) for joint in joints]
    return Muscles(
        joints,
        springs,
        [own.active() for own in named],
        [own.damping.value for own in named],
    )
