"""The GripLoad reads from a grip's bushing what a held racket does to the hand."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.math import SpatialForce_
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ForceElementIndex, JointIndex
from pydrake.systems.framework import BasicVector_, Context, DiagramBuilder, LeafSystem_
from pydrake.systems.scalar_conversion import TemplateSystem

from drake_racket.io.errors import InputError
from drake_racket.plant.grip import Grip
from drake_racket.plant.systems.ports import HandLoad
from drake_racket.plant.systems.scalars import on_float


@TemplateSystem.define("GripLoad_", scope=sys.modules[__name__])
def GripLoad_(T: Any) -> Any:
    """Gives the load as a LeafSystem on the scalar type T; `GripLoad` is that on float."""

    class Impl(LeafSystem_[T]):
        """The wrench that a racket puts on the hand, and the work it does on the grip.

        Input ports:
            state: the plant's multibody state [q; v].
            reaction_forces: the plant's port of that name (a list of SpatialForce); only of a grip
                with a joint (weld, torsional).
        Output ports:
            hand_load (6, HandLoad): spatial force F_Ho_H on the hand, about the hand frame's origin
                and in its axes: torque (N m), then force (N).
            power (1): going from the racket and the hand into the grip's springs and dampers (W).
        Numeric parameters:
            0 constants (12): the bushing's torque stiffness, torque damping, force stiffness and
              force damping, three each; as in the plant's Context (`set_grip_load_parameters`).
        Equations: Drake's LinearBushingRollPitchYaw, evaluated by Drake; a joint's reaction on the
        racket, F_CJc_Jc, acts on the hand reversed, at the same point.
        """

        def _construct(
            self, element: int | None, joint: int | None, plant: Any, converter: Any = None
        ) -> None:
            LeafSystem_[T].__init__(self, converter)
            self.element, self.joint, self.plant = element, joint, plant
            self._scratch = plant.CreateDefaultContext()
            self._seen: Any = None  # the state and the constants that the scratch Context has
            self._on_hand: Any = None  # the bushing's force there, on frame A
            constants: Any = np.array([T(0.0)] * 12)
            if element is not None:
                self._bushing = plant.get_force_element(ForceElementIndex(element))
                constants = bushing_constants(self._bushing, self._scratch)
            self.DeclareNumericParameter(BasicVector_[T](constants))
            self._state = self.DeclareVectorInputPort("state", plant.num_multibody_states())
            needs = {self._state.ticket(), self.all_parameters_ticket()}
            load_needs = set(needs)
            if joint is not None:
                self._joint = plant.get_joint(JointIndex(joint))
                # where it stands in the list of reactions (Joint.ordinal is not bound everywhere)
                self._place = [int(i) for i in plant.GetJointIndices()].index(joint)
                model = AbstractValue.Make([SpatialForce_[T]()])
                self._reactions = self.DeclareAbstractInputPort("reaction_forces", model)
                load_needs.add(self._reactions.ticket())
            self.DeclareVectorOutputPort(
                "hand_load", len(HandLoad), self._calc_load, prerequisites_of_calc=load_needs
            )
            self.DeclareVectorOutputPort("power", 1, self._calc_power, prerequisites_of_calc=needs)

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            plant = other.plant.ToScalarType[T]()
            Impl._construct(self, other.element, other.joint, plant, converter=converter)

        def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
            """No continuous state. Stated because Drake 1.58 takes 4 us to find no override."""

        def _at(self, context: Any, before: float = 0.0) -> Any:
            """A Context of this system's own with the present state and constants.

            `before`: with the positions of so long ago (s), at these velocities.
            """
            scratch, state = self._scratch, self._state.Eval(context)
            constants = context.get_numeric_parameter(0).CopyToVector()
            seen = (state.tobytes(), constants.tobytes(), before) if T is float else None
            if seen is not None and seen == self._seen:
                return scratch
            if self.element is not None:
                bushing = self._bushing
                if seen is None or self._seen is None or seen[1] != self._seen[1]:
                    bushing.SetTorqueStiffnessConstants(scratch, constants[0:3])
                    bushing.SetTorqueDampingConstants(scratch, constants[3:6])
                    bushing.SetForceStiffnessConstants(scratch, constants[6:9])
                    bushing.SetForceDampingConstants(scratch, constants[9:12])
            self.plant.SetPositionsAndVelocities(scratch, state)
            if before:
                q, v = self.plant.GetPositions(scratch), self.plant.GetVelocities(scratch)
                moved = q - before * self.plant.MapVelocityToQDot(scratch, v)
                self.plant.SetPositions(scratch, moved)
            if self.element is not None:
                self._on_hand = bushing.CalcBushingSpatialForceOnFrameA(scratch)
            self._seen = seen
            return scratch

        def _calc_load(self, context: Any, output: Any) -> None:
            scratch = self._at(context)
            load: Any = np.array([T(0.0)] * 6)
            if self.element is not None:
                load = load + self._on_hand.get_coeffs()
            if self.joint is not None:
                reaction = self._reactions.Eval(context)[self._place]
                hand, racket = self._joint.frame_on_parent(), self._joint.frame_on_child()
                R_HG = racket.CalcPose(scratch, hand).rotation().matrix()
                turned = [R_HG @ reaction.rotational(), R_HG @ reaction.translational()]
                load = load - np.concatenate(turned)
            output.SetFromVector(load)

        def _calc_power(self, context: Any, output: Any) -> None:
            total = T(0.0)
            if self.element is not None:
                scratch, bushing = self._at(context, 0.5 * self.plant.time_step()), self._bushing
                for frame, force in (
                    (bushing.frameA(), self._on_hand),
                    (bushing.frameC(), bushing.CalcBushingSpatialForceOnFrameC(scratch)),
                ):
                    R_WF = frame.CalcPoseInWorld(scratch).rotation().matrix()
                    V_WF = frame.CalcSpatialVelocityInWorld(scratch)
                    total -= (R_WF.T @ V_WF.rotational()) @ force.rotational()
                    total -= (R_WF.T @ V_WF.translational()) @ force.translational()
            output[0] = total

    return Impl


GripLoad = on_float(GripLoad_)
"""`GripLoad` is `GripLoad_` on plain numbers: the load of the racket on the hand."""


def bushing_constants(bushing: Any, plant_context: Any) -> Any:
    """Gives a bushing's constants in a Context, (12,), in the order of GripLoad's parameter."""
    return np.concatenate(
        [
            bushing.GetTorqueStiffnessConstants(plant_context),
            bushing.GetTorqueDampingConstants(plant_context),
            bushing.GetForceStiffnessConstants(plant_context),
            bushing.GetForceDampingConstants(plant_context),
        ]
    )


def add_grip_load(
    builder: DiagramBuilder, plant: MultibodyPlant, grip: Grip, *, name: str = "grip_load"
) -> Any:
    """Adds a GripLoad for `grip` to `builder` and connects it; returns the system.

    Call it after `plant.Finalize()`. It counts with the constants that the grip was added with;
    after `Grip.set_stiffness` on a Context call `set_grip_load_parameters`.

    Raises:
        InputError: the plant is not finalized.

    """
    if not plant.is_finalized():
        raise InputError("add_grip_load: plant", "not finalized", "a plant after Finalize()")
    bushing, joint = grip.bushing, grip.joint
    system = builder.AddNamedSystem(
        name,
        GripLoad(
            None if bushing is None else int(bushing.index()),
            None if joint is None else int(joint.index()),
            plant,
        ),
    )
    builder.Connect(plant.get_state_output_port(), system.GetInputPort("state"))
    if joint is not None:
        builder.Connect(
            plant.get_reaction_forces_output_port(), system.GetInputPort("reaction_forces")
        )
    return system


def set_grip_load_parameters(grip_load: Any, grip: Grip, root: Context) -> None:
    """Copies the grip's constants from the plant's Context to the GripLoad's."""
    if grip.bushing is None:
        return
    plant_context = grip.plant.GetMyContextFromRoot(root)
    constants = bushing_constants(grip.bushing, plant_context)
    context = grip_load.GetMyMutableContextFromRoot(root)
    context.get_mutable_numeric_parameter(0).SetFromVector(constants)
