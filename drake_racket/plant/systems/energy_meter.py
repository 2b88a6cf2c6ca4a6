"""The EnergyMeter meters what an impact loses, integrated beside the motion."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import BasicVector_, Context, DiagramBuilder, LeafSystem_
from pydrake.systems.primitives import Adder
from pydrake.systems.scalar_conversion import TemplateSystem

from drake_racket.io.errors import InputError
from drake_racket.laws.totals import GRIP, LOST_JOINT, LOST_STRINGS, TOTALS
from drake_racket.plant.compose import Impact
from drake_racket.plant.systems.scalars import on_float


@TemplateSystem.define("EnergyMeter_", scope=sys.modules[__name__])
def EnergyMeter_(T: Any) -> Any:
    """Gives the meter as a LeafSystem on the scalar type T; `EnergyMeter` is that on float."""

    class Impl(LeafSystem_[T]):
        """Integrates lost power and the contact's impulse.

        Input ports:
            power (6): the BallContact's port of that name (W, W, W, N, N, N).
            state: the plant's multibody state, with the rates of the j frame joints (rad/s).
            string_energy (2): the StringBed's port of that name; read if the strings are damped.
            grip_power (1): the GripLoad's power (W); only of a meter for a held racket.
        Output ports:
            totals (9, EnergyTotals): lost in the ball's damper, lost to friction, gained from the
                couple (J); impulse on the ball in the world (N s, three); lost at the joints, lost
                in the strings, gone into the grip's springs and dampers (J).
        Numeric parameters:
            0 damping (j + 1): of each frame joint (N m s/rad); 1 if the strings are damped, or 0.
              As in the Contexts of plant and string-bed (`set_meter_parameters`).
        Continuous state (9): the totals.
        """

        def _construct(
            self,
            num_states: int,
            rates: tuple[int, ...],
            damping: tuple[float, ...],
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
            *dampings, damped = context.get_numeric_parameter(0).CopyToVector()
            rates = self._rates
            rates[:LOST_JOINT] = self._power.Eval(context)
            rates[LOST_JOINT] = sum(
                damping * state[i] * state[i]
                for damping, i in zip(dampings, self.rates, strict=True)
            )
            rates[LOST_STRINGS] = self._strings.Eval(context)[1] if damped > 0.5 else T(0.0)
            if self.gripped:
                rates[GRIP] = self._grip.Eval(context)[0]
            derivatives.get_mutable_vector().SetFromVector(rates)

    return Impl


EnergyMeter = on_float(EnergyMeter_)
"""`EnergyMeter` is `EnergyMeter_` on plain numbers: the integrals of losses and impulse."""


def add_energy_meter(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    impact: Impact,
    grip_load: Any | Sequence[Any] | None = None,
) -> Any:
    """Adds an EnergyMeter to the systems of one impact (with a ball) and returns it.

    It counts with the damping that plant and strings have by default; where a Context has other
    values, call `set_meter_parameters` before the run.

    Args:
        grip_load: the GripLoad of the hand that holds the racket, if one does; of a hand that has
            mass both of its sides, in a list.

    Raises:
        InputError: the impact has no ball.

    """
    if impact.contact is None:
        raise InputError("add_energy_meter: impact", "without a ball", "an impact with a ball")
    loads: list[Any] = [] if grip_load is None else [grip_load]
    if isinstance(grip_load, Sequence):
        loads = list(grip_load)
    offset = plant.num_positions()
    racket = impact.racket
    rates = tuple(offset + joint.velocity_start() for joint in racket.frame_joints)
    dampings = [joint.damping for joint in racket.joint_constants()]
    strings = racket.parameters.string_bed.damping.value > 0.0
    name = plant.GetModelInstanceName(racket.model_instance)
    meter = builder.AddNamedSystem(
        f"{name}_energy_meter",
        EnergyMeter(
            plant.num_multibody_states(),
            rates,
            (*dampings, float(strings)),
            bool(loads),
        ),
    )
    builder.Connect(impact.contact.GetOutputPort("power"), meter.GetInputPort("power"))
    builder.Connect(plant.get_state_output_port(), meter.GetInputPort("state"))
    strings = impact.string_bed.GetOutputPort("string_energy")
    builder.Connect(strings, meter.GetInputPort("string_energy"))
    powers = [load.GetOutputPort("power") for load in loads]
    if len(powers) > 1:
        adder = builder.AddNamedSystem(f"{name}_grip_power", Adder(len(powers), 1))
        for i, power in enumerate(powers):
            builder.Connect(power, adder.get_input_port(i))
        powers = [adder.get_output_port()]
    if powers:
        builder.Connect(powers[0], meter.GetInputPort("grip_power"))
    return meter


def set_meter_parameters(meter: Any, impact: Impact, root: Context) -> None:
    """Copies joint and string damping from plant and string-bed to the meter's Context."""
    plant_context = impact.racket.plant.GetMyContextFromRoot(root)
    dampings = [joint.damping for joint in impact.racket.joint_constants(plant_context)]
    bed = impact.string_bed
    strings = bed.GetMyContextFromRoot(root).get_numeric_parameter(bed.DAMPING)[0]
    context = meter.GetMyMutableContextFromRoot(root)
    context.get_mutable_numeric_parameter(0).SetFromVector(
        np.array([*dampings, float(strings > 0.0)])
    )
