"""The LeafSystem here gives passive torques at the ends of ranges. `laws.limits` has the law.

A continuous plant ignores joint limits. A discrete plant enforces them itself: there
`add_joint_limits` refuses.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import BasicVector_, DiagramBuilder, LeafSystem_
from pydrake.systems.scalar_conversion import TemplateSystem

from drake_racket.io.errors import InputError
from drake_racket.laws.limits import limit_energies, limit_losses, limit_torques
from drake_racket.limbs.limb import Limb
from drake_racket.parameters.limb import JOINTS, load_upper_limb
from drake_racket.plant.systems.scalars import on_float


@dataclass(frozen=True)
class LimitLaw:
    """Holds the law's numbers, one per joint: range (rad), stiffness (N m/rad), damping (s/rad)."""

    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    damping: NDArray[np.float64]


@dataclass(frozen=True)
class LimitCoordinates:
    """Says where the joints sit in a plant's state [q; v]."""

    positions: NDArray[np.int64]
    velocities: NDArray[np.int64]
    num_positions: int
    num_velocities: int


@TemplateSystem.define("JointLimits_", scope=sys.modules[__name__])
def JointLimits_(T: Any) -> Any:
    """Gives the limits as a LeafSystem on the scalar type T; `JointLimits` is that on float."""

    class Impl(LeafSystem_[T]):
        """Torques at the ends of joints' ranges; n joints of one degree of freedom.

        Input ports:
            state: the plant's multibody state [q; v].
        Output ports:
            generalized_force (nv): for the plant's applied_generalized_force port (N m).
            energy (1): held by all limits (J).
            power (1): lost at all limits (W).
        Numeric parameters:
            0 lower (n): rad; 1 upper (n): rad; 2 stiffness (n): N m/rad; 3 damping (n): s/rad.
        Equations: `limit_torques`, `limit_energies`, `limit_losses`.
        """

        LOWER, UPPER, STIFFNESS, DAMPING = range(4)

        def _construct(self, law: LimitLaw, at: LimitCoordinates, converter: Any = None) -> None:
            LeafSystem_[T].__init__(self, converter)
            self.law, self.at = law, at
            self._zeros = np.array([T(0.0)] * at.num_velocities)
            for values in (law.lower, law.upper, law.stiffness, law.damping):
                self.DeclareNumericParameter(BasicVector_[T](np.array([T(x) for x in values])))
            size = at.num_positions + at.num_velocities
            self._state = self.DeclareVectorInputPort("state", size)
            needs = {self._state.ticket(), self.all_parameters_ticket()}
            for name, count, calc in (
                ("generalized_force", at.num_velocities, self._calc_force),
                ("energy", 1, self._calc_energy),
                ("power", 1, self._calc_power),
            ):
                self.DeclareVectorOutputPort(name, count, calc, prerequisites_of_calc=needs)

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            Impl._construct(self, other.law, other.at, converter=converter)

        def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
            """No continuous state. Stated because Drake 1.58 takes 4 us to find no override."""

        def _motion(self, context: Any) -> tuple[Any, Any]:
            state = self._state.Eval(context)
            return state[self.at.positions], state[self.at.num_positions + self.at.velocities]

        def _numbers(self, context: Any) -> list[Any]:
            return [context.get_numeric_parameter(i).CopyToVector() for i in range(4)]

        def _calc_force(self, context: Any, output: Any) -> None:
            force = self._zeros.copy()
            torques = limit_torques(*self._motion(context), *self._numbers(context))
            force[self.at.velocities] = torques
            output.SetFromVector(force)

        def _calc_energy(self, context: Any, output: Any) -> None:
            q, _ = self._motion(context)
            lower, upper, stiffness, _ = self._numbers(context)
            output[0] = limit_energies(q, lower, upper, stiffness).sum()

        def _calc_power(self, context: Any, output: Any) -> None:
            losses = limit_losses(*self._motion(context), *self._numbers(context))
            output[0] = losses.sum()

    return Impl


JointLimits = on_float(JointLimits_)


def add_joint_limits(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    limb: Limb,
    *,
    stiffness: float | Sequence[float] | None = None,
    damping: float | Sequence[float] | None = None,
    name: str = "joint_limits",
) -> Any:
    """Adds the limits of `limb` to `builder`, with the ranges of the plant's joints.

    Call it after `plant.Finalize()`, once per limb. The forces are connected with all others:
    `connect_forces(..., generalized=[system.GetOutputPort("generalized_force")])`.

    Args:
        stiffness: k (N m/rad), one number or one per joint; None takes the shipped upper limb's,
            by the joints' names.
        damping: d (s/rad), likewise.

    Returns:
        The system.

    Raises:
        InputError: the plant is not finalized, is discrete, or is not in the builder; a joint has
            more than one degree of freedom; no joint has a limit; numbers that do not fit.

    """
    if not plant.is_finalized():
        raise InputError("add_joint_limits: plant", "not finalized", "a plant after Finalize()")
    if not any(system is plant for system in builder.GetSystems()):
        raise InputError(
            "add_joint_limits: plant", "not in the builder", "a plant that the builder holds"
        )
    if plant.time_step() > 0.0:
        raise InputError(
            "add_joint_limits: plant",
            f"a time step of {plant.time_step():g} s",
            "a continuous plant (a discrete one enforces its joints' limits itself)",
        )
    law = limit_law(limb, stiffness=stiffness, damping=damping)
    at = LimitCoordinates(
        positions=limb.position_indices(),
        velocities=limb.velocity_indices(),
        num_positions=plant.num_positions(),
        num_velocities=plant.num_velocities(),
    )
    system = builder.AddNamedSystem(name, JointLimits(law, at))
    builder.Connect(plant.get_state_output_port(), system.GetInputPort("state"))
    return system


def limit_law(
    limb: Limb,
    *,
    stiffness: float | Sequence[float] | None = None,
    damping: float | Sequence[float] | None = None,
) -> LimitLaw:
    """Gives the law's numbers for a limb, as `add_joint_limits` has them.

    Args:
        stiffness: N m/rad (of a slide N/m).  damping: N m s/rad (N s/m).

    Raises:
        InputError: as `add_joint_limits`.

    """
    for joint in limb.joints:
        if (joint.num_positions(), joint.num_velocities()) != (1, 1):
            raise InputError(
                f"add_joint_limits: joint {joint.name()}",
                f"{joint.num_velocities()} degrees of freedom",
                "joints of one degree of freedom",
            )
    lower = np.array([joint.position_lower_limits()[0] for joint in limb.joints])
    upper = np.array([joint.position_upper_limits()[0] for joint in limb.joints])
    if np.all(np.isinf(lower) & np.isinf(upper)):
        raise InputError("add_joint_limits: limb", "no limits", "a limb whose joints have limits")
    if stiffness is None or damping is None:
        shipped = load_upper_limb()
        _check_names(limb)
        if stiffness is None:
            joints = [shipped.joint(joint.name()) for joint in limb.joints]
            stiffness = [joint.limit_stiffness.value for joint in joints]
        if damping is None:
            damping = shipped.limit_damping.value
    return LimitLaw(
        lower=lower,
        upper=upper,
        stiffness=_per_joint(stiffness, "stiffness", len(limb.joints)),
        damping=_per_joint(damping, "damping", len(limb.joints)),
    )


def _check_names(limb: Limb) -> None:
    for name in limb.joint_names():
        if name not in JOINTS:
            raise InputError(
                f"add_joint_limits: joint {name}",
                "no stiffness and damping",
                "both given, for a limb that is not the shipped one",
            )


def _per_joint(values: float | Sequence[float], key: str, count: int) -> NDArray[np.float64]:
    numbers = np.asarray(values, dtype=float)
    if numbers.shape not in ((), (count,)):
        raise InputError(f"add_joint_limits: {key}", values, f"one number, or {count}")
    if not (np.all(np.isfinite(numbers)) and np.all(numbers >= 0.0)):
        raise InputError(f"add_joint_limits: {key}", values, "finite numbers, 0 or more")
    return np.broadcast_to(numbers, (count,)).copy()
