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
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import BasicVector_, Context, DiagramBuilder, LeafSystem_
from pydrake.systems.scalar_conversion import TemplateSystem

from drake_racket.io.errors import InputError
from drake_racket.limbs.power import (
    LOST_JOINTS,
    LOST_LIMITS,
    TORQUE_WORK,
    joint_energy,
    limb_potential,
)
from drake_racket.plant.compose import Impact

if TYPE_CHECKING:
    from drake_racket.limbs.striking import StrikingLimb

LOST_BALL, LOST_FRICTION, COUPLE, IMPULSE, LOST_JOINT, LOST_STRINGS = 0, 1, 2, slice(3, 6), 6, 7
GRIP, TOTALS = 8, 9


@TemplateSystem.define("EnergyMeter_")
def EnergyMeter_(T: Any) -> Any:
    """The meter as a LeafSystem on the scalar type T; `EnergyMeter` is that on float."""

    class Impl(LeafSystem_[T]):
        """Integrates lost power and the contact's impulse.

        Input ports:
            power (6): the BallContact's port of that name (W, W, W, N, N, N).
            joint_rates (2): in-plane, out-of-plane (rad/s), as part of the plant's state port.
            string_energy (2): the StringBed's energy port; read only if the strings are damped.
            grip_power (1): the GripLoad's power (W); only of a meter for a held racket.
        Output ports:
            totals (9): lost in the ball's damper, lost to friction, gained from the couple (J);
                impulse on the ball in the world (N s, three); lost at the joint, lost in the
                strings, gone into the grip's springs and dampers (J).
        Numeric parameters:
            0 damping: in-plane, out-of-plane joint (N m s/rad); 1 if the strings are damped, or 0.
              As in the Contexts of plant and string-bed (`set_meter_parameters`).
        Continuous state (9): the totals.
        """

        def _construct(
            self,
            num_states: int,
            rates: tuple[int, int],
            damping: tuple[float, float, float],
            gripped: bool,
            converter: Any = None,
        ) -> None:
            LeafSystem_[T].__init__(self, converter)
            self.num_states, self.rates, self.gripped = num_states, rates, gripped
            self.damping = damping
            self.DeclareNumericParameter(BasicVector_[T](np.array([T(float(x)) for x in damping])))
            self._power = self.DeclareVectorInputPort("power", 6)
            self._plant_state = self.DeclareVectorInputPort("state", num_states)
            self._strings = self.DeclareVectorInputPort("string_energy", 2)
            if gripped:
                self._grip = self.DeclareVectorInputPort("grip_power", 1)
            self._rates = np.array([T(0.0)] * TOTALS)
            index = self.DeclareContinuousState(TOTALS)
            self.DeclareStateOutputPort("totals", index)

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            arguments = other.num_states, other.rates, other.damping, other.gripped
            Impl._construct(self, *arguments, converter=converter)

        def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
            state = self._plant_state.Eval(context)
            in_plane, out_of_plane, damped = context.get_numeric_parameter(0).CopyToVector()
            rate_z, rate_y = state[self.rates[0]], state[self.rates[1]]
            rates = self._rates
            rates[:LOST_JOINT] = self._power.Eval(context)
            rates[LOST_JOINT] = in_plane * rate_z * rate_z + out_of_plane * rate_y * rate_y
            rates[LOST_STRINGS] = self._strings.Eval(context)[1] if damped > 0.5 else T(0.0)
            if self.gripped:
                rates[GRIP] = self._grip.Eval(context)[0]
            derivatives.get_mutable_vector().SetFromVector(rates)

    return Impl


EnergyMeter = EnergyMeter_[float]


def add_energy_meter(
    builder: DiagramBuilder, plant: MultibodyPlant, impact: Impact, grip_load: Any | None = None
) -> Any:
    """Adds an EnergyMeter to the systems of one impact (with a ball) and returns it.

    It counts with the damping that plant and strings have by default; where a Context has other
    values, call `set_meter_parameters` before the run.

    Args:
        grip_load: the GripLoad of the hand that holds the racket, if one does.

    Raises:
        InputError: the impact has no ball.

    """
    if impact.contact is None:
        raise InputError("add_energy_meter: impact", "without a ball", "an impact with a ball")
    offset = plant.num_positions()
    racket = impact.racket
    rates = (
        offset + racket.in_plane.velocity_start(),
        offset + racket.out_of_plane.velocity_start(),
    )
    _, pitch, yaw = racket.bushing.torque_damping_constants()
    strings = racket.parameters.string_bed.damping.value > 0.0
    name = plant.GetModelInstanceName(racket.model_instance)
    meter = builder.AddNamedSystem(
        f"{name}_energy_meter",
        EnergyMeter(
            plant.num_multibody_states(),
            rates,
            (yaw, pitch, float(strings)),
            grip_load is not None,
        ),
    )
    builder.Connect(impact.contact.GetOutputPort("power"), meter.GetInputPort("power"))
    builder.Connect(plant.get_state_output_port(), meter.GetInputPort("state"))
    builder.Connect(impact.string_bed.GetOutputPort("energy"), meter.GetInputPort("string_energy"))
    if grip_load is not None:
        builder.Connect(grip_load.GetOutputPort("power"), meter.GetInputPort("grip_power"))
    return meter


def set_meter_parameters(meter: Any, impact: Impact, root: Context) -> None:
    """Copies joint and string damping from plant and string-bed to the meter's Context."""
    plant_context = impact.racket.plant.GetMyContextFromRoot(root)
    _, pitch, yaw = impact.racket.bushing.GetTorqueDampingConstants(plant_context)
    bed = impact.string_bed
    strings = bed.GetMyContextFromRoot(root).get_numeric_parameter(bed.DAMPING)[0]
    context = meter.GetMyMutableContextFromRoot(root)
    context.get_mutable_numeric_parameter(0).SetFromVector(
        np.array([yaw, pitch, float(strings > 0.0)])
    )


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
