"""The LeafSystem here meters a limb's work and losses, and what energy the limb holds."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import BasicVector_, Context, LeafSystem_
from pydrake.systems.scalar_conversion import TemplateSystem

from drake_racket.laws.totals import LOST_JOINTS, LOST_LIMITS, TORQUE_WORK
from drake_racket.limbs.limb import Limb
from drake_racket.plant.systems.scalars import on_float


@TemplateSystem.define("LimbPower_", scope=sys.modules[__name__])
def LimbPower_(T: Any) -> Any:
    """Gives the meter as a LeafSystem on the scalar type T; `LimbPower` is that on float."""

    class Impl(LeafSystem_[T]):
        """Powers of a limb's joints, to be integrated (Drake's Integrator).

        Input ports:
            state: the plant's multibody state [q; v].
            torques (n): on the limb's joints (N m), in the order of its velocities.
            limit_power (1): the JointLimits' power (W); not connected where there are none.
        Output ports:
            power (3): of the torques, lost in the joints' dampers, lost at the joints' limits (W).
        Numeric parameters:
            0 damping (n + m) of the joints (N m s/rad): the limb's, then others of its models.
        """

        def _construct(
            self, states: int, velocities: Any, torques: int, damping: Any, converter: Any = None
        ) -> None:
            LeafSystem_[T].__init__(self, converter)
            self.states, self.velocities, self.damping = states, velocities, damping
            self.DeclareNumericParameter(BasicVector_[T](np.array([T(float(d)) for d in damping])))
            self._state = self.DeclareVectorInputPort("state", states)
            self.torques = torques
            self._torques = self.DeclareVectorInputPort("torques", torques)
            self._limits = self.DeclareVectorInputPort("limit_power", 1)
            inputs = (self._state, self._torques, self._limits)
            needs = {self.all_parameters_ticket(), *(port.ticket() for port in inputs)}
            self.DeclareVectorOutputPort("power", 3, self._calc_power, prerequisites_of_calc=needs)

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            Impl._construct(
                self,
                other.states,
                other.velocities,
                other.torques,
                other.damping,
                converter=converter,
            )

        def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
            """No continuous state. Stated because Drake 1.58 takes 4 us to find no override."""

        def _calc_power(self, context: Any, output: Any) -> None:
            rates = self._state.Eval(context)[self.velocities]
            damping = context.get_numeric_parameter(0).CopyToVector()
            output[TORQUE_WORK] = self._torques.Eval(context) @ rates[: self.torques]
            output[LOST_JOINTS] = damping @ (rates * rates)
            limits = self._limits
            output[LOST_LIMITS] = limits.Eval(context)[0] if limits.HasValue(context) else T(0.0)

    return Impl


LimbPower = on_float(LimbPower_)


def make_limb_power(plant: MultibodyPlant, limb: Limb) -> Any:
    """Gives a LimbPower for `limb` of the finalized `plant`, with the dampings of its joints.

    And of those off the chain, whose losses the balance needs as well.
    """
    joints = [*limb.joints, *limb.others()]
    damping = np.concatenate([joint.default_damping_vector() for joint in joints])
    velocities = np.concatenate(
        [j.velocity_start() + np.arange(j.num_velocities()) for j in joints]
    )
    torques = sum(joint.num_velocities() for joint in limb.joints)
    return LimbPower(
        plant.num_multibody_states(), plant.num_positions() + velocities, torques, damping
    )


def set_limb_power_damping(power: Any, plant: MultibodyPlant, limb: Limb, root: Context) -> None:
    """Copies the dampings of a limb's joints from the plant's Context to the LimbPower's."""
    context = plant.GetMyContextFromRoot(root)
    joints = [*limb.joints, *limb.others()]
    damping = np.concatenate([joint.GetDampingVector(context) for joint in joints])
    own = power.GetMyMutableContextFromRoot(root)
    own.get_mutable_numeric_parameter(0).SetFromVector(damping)


def limb_bodies(limb: Limb, plant: MultibodyPlant) -> list[RigidBody]:
    """Gives the limb's bodies that have mass."""
    context = plant.CreateDefaultContext()
    bodies = [
        plant.get_body(index)
        for instance in limb.model_instances
        for index in plant.GetBodyIndices(instance)
    ]
    return [body for body in bodies if body.get_mass(context) > 0.0]
