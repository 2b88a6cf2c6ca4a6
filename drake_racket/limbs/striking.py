"""Builds a limb in the ready-made case from the settings, wires it, and puts it into its stroke."""

from __future__ import annotations

import contextlib
import json
import logging
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from typing import Any

from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort
from pydrake.systems.primitives import Integrator

from drake_racket.io.errors import InputError
from drake_racket.io.schema import shown
from drake_racket.limbs.files.joints import settle_joints
from drake_racket.limbs.inertia import check_inertia
from drake_racket.limbs.limb import Limb
from drake_racket.limbs.limits import add_joint_limits
from drake_racket.limbs.models import LimbBuilder, add_limb_model, find_limb
from drake_racket.limbs.power import limb_bodies, make_limb_power, set_limb_power_damping
from drake_racket.limbs.stroke import StrokeState, apply_stroke, solve_stroke
from drake_racket.limbs.torques import (
    JointTorques,
    Muscles,
    add_joint_torques,
    initial_torques,
)
from drake_racket.limbs.upper_limb import add_upper_limb
from drake_racket.parameters.limb import JOINTS, UpperLimbParameters, load_upper_limb
from drake_racket.parameters.limb_settings import LimbSettings
from drake_racket.plant.grip import Grip
from drake_racket.plant.racket import Racket


def add_striking_limb(
    plant: MultibodyPlant,
    settings: LimbSettings,
    builder: LimbBuilder | None = None,
    shipped: UpperLimbParameters | None = None,
) -> Limb:
    """Adds the limb of the settings, or the caller's own, to `plant`. Before `Finalize`.

    Args:
        shipped: the shipped limb's parameters, if they are loaded already.

    Raises:
        InputError: the settings do not fit, or the caller's limb is none.

    """
    if builder is not None:
        made = builder(plant)
        if not isinstance(made, Limb):
            if made is None or not hasattr(made, "body"):
                raise InputError("limb", made, "a function that returns a Limb or the hand's Frame")
            made = find_limb(plant, made)
        _check_constraints(plant, made)
        return settle_joints(plant, made, locked=settings.locked, initial_deg=settings.initial_deg)
    turned = RotationMatrix.MakeZRotation(math.radians(settings.trunk_azimuth_deg))
    X_WF = RigidTransform(turned, settings.place)
    if settings.model == "upper_limb":
        limb = add_upper_limb(
            plant,
            shipped or load_upper_limb(mass=settings.mass or None, height=settings.height or None),
            side=settings.side,
            X_PF=X_WF,
            grip_rotation=math.radians(settings.grip_rotation_deg),
        )
        return settle_joints(plant, limb, locked=settings.locked, initial_deg=settings.initial_deg)
    return add_limb_model(
        plant,
        settings.model,
        settings.hand,
        base=settings.base,
        X_WB=X_WF,
        locked=settings.locked,
        initial_deg=settings.initial_deg,
        packages=settings.packages,
        keyframe=settings.keyframe,
    )


def _check_constraints(plant: MultibodyPlant, limb: Limb) -> None:
    """Refuses constraints of a user's plant that the limb's kinematics would not see."""
    unseen = plant.num_constraints() - len(limb.ties)
    if unseen > 0:
        raise InputError(
            "limb: the plant",
            f"{unseen} constraints",
            "none but coupler constraints that its Limb names (find_limb(..., ties=...)), or the"
            " model as a file, whose constraints are read",
        )


@dataclass(frozen=True, repr=False)
class StrikingLimb:
    """The StrikingLimb holds handles to a limb and its systems in a Diagram.

    Attributes:
        bodies: those of the limb that have mass.
        torques: on its joints.
        limits: the JointLimits; None without them (other limbs, discrete plants).
        energy: the Integrator of the LimbPower; None without an audit.
        power: the LimbPower; None without an audit.
        muscles: of the shipped limb; None where they are not active.

    """

    limb: Limb
    bodies: list[RigidBody]
    torques: JointTorques
    limits: Any | None
    energy: Any | None
    power: Any | None = None
    muscles: Muscles | None = None
    _strokes: dict[str, StrokeState] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        """Shows the limb."""
        return shown(self, repr(self.limb))

    def generalized_force_ports(self) -> list[OutputPort]:
        """Lists the forces for the plant's applied_generalized_force."""
        ports = [self.torques.generalized_force_port()]
        if self.limits is not None:
            ports.append(self.limits.GetOutputPort("generalized_force"))
        return [port for port in ports if port is not None]

    def set_state(
        self,
        root: Context,
        racket: Racket,
        grip: Grip,
        settings: LimbSettings,
    ) -> StrokeState:
        """Puts limb and racket into the settings' stroke, and sets the joint torques.

        A stroke is solved once per Diagram: it does not depend on what a Context varies.

        Raises:
            InputError: the limb cannot meet the stroke.

        """
        plant = racket.plant
        context = plant.GetMyMutableContextFromRoot(root)
        key = json.dumps(asdict(settings.stroke), sort_keys=True)
        state = self._strokes.get(key)
        if state is None:
            state = solve_stroke(
                plant,
                self.limb,
                racket.frame("gsc"),
                settings.stroke,
                held_frame=grip.racket_frame if grip.joint is None else None,
            )
        apply_stroke(plant, context, self.limb, racket, state)
        if key not in self._strokes:
            check_inertia(plant, context, self.limb)
            self._strokes[key] = state
        if self.muscles is not None:
            self.muscles.hold(plant, context, settings.activation)
            if self.power is not None:
                set_limb_power_damping(self.power, plant, self.limb, root)
        if self.torques.source is not None:
            torques = initial_torques(settings.joint_torques, plant, context, self.limb, racket)
            self.torques.set(root, torques)
        return state


@contextlib.contextmanager
def limits_are_ours(limb: StrikingLimb | None) -> Iterator[None]:
    """Silences Drake's warning that a continuous plant has no joint limits, where `limits` are.

    Drake gives it when reactions are first evaluated. Without `limits` it is true, and is left.
    """
    if limb is None or limb.limits is None:
        yield
        return
    logger = logging.getLogger("drake")

    def other(record: logging.LogRecord) -> bool:
        return "does not handle joint limits" not in record.getMessage()

    logger.addFilter(other)
    try:
        yield
    finally:
        logger.removeFilter(other)


def wire_striking_limb(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    limb: Limb,
    settings: LimbSettings,
    *,
    audit: bool,
    export_torques: bool,
    shipped: UpperLimbParameters | None = None,
    muscles: Muscles | None = None,
) -> StrikingLimb:
    """Adds torques, limits and the energy meter of a limb. After `Finalize`.

    Args:
        export_torques: the joint torques come from the Diagram's input port `joint_torques`.
        shipped: the shipped limb's parameters, if they are loaded already.
        muscles: that were added to it.

    """
    torques = add_joint_torques(builder, plant, limb, export=export_torques)
    limits = None
    if _takes_limits(limb, settings):
        stiffness = damping = None
        if shipped is not None:
            stiffness = [shipped.joint(name).limit_stiffness.value for name in limb.joint_names()]
            damping = shipped.limit_damping.value
        limits = add_joint_limits(builder, plant, limb, stiffness=stiffness, damping=damping)
    energy = power = None
    if audit:
        power = builder.AddNamedSystem("limb_power", make_limb_power(plant, limb))
        builder.Connect(plant.get_state_output_port(), power.GetInputPort("state"))
        if torques.source is None:
            builder.ConnectInput("joint_torques", power.GetInputPort("torques"))
        else:
            builder.Connect(torques.source.get_output_port(), power.GetInputPort("torques"))
        if limits is not None:
            builder.Connect(limits.GetOutputPort("power"), power.GetInputPort("limit_power"))
        energy = builder.AddNamedSystem("limb_energy", Integrator(3))
        builder.Connect(power.get_output_port(), energy.get_input_port())
    return StrikingLimb(limb, limb_bodies(limb, plant), torques, limits, energy, power, muscles)


def _takes_limits(limb: Limb, settings: LimbSettings) -> bool:
    """Whether passive limits are asked for, known (the shipped limb's), and not Drake's own."""
    names = limb.joint_names()
    known = names == [n for n in JOINTS if n in names] and len(names) == len(JOINTS) - len(
        set(settings.locked) & set(JOINTS)
    )
    return settings.limits and known and limb.plant.time_step() == 0.0
