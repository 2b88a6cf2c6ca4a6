"""A hand on the racket's grip, of one of three kinds.

    weld        the racket's grip frame G is fixed on the user's hand frame H
    torsional   G turns about H's origin against three torsional spring-dampers: translation is
                fixed, as in King, Kentel & Mitchell (2012), J. Biomech. 45:1048-1052
    compliant   three torsional and three translational spring-dampers

The spring-dampers are one `LinearBushingRollPitchYaw`: torques -k q - c qdot on roll, pitch and yaw
of G in H, and forces -K p - D pdot along its axes. At rest G lies on H. H may be fixed in the world
or sit on an arm.

No source at hand prints the numbers: the shipped ones are inferred. The default, `normal`, is the
stiffness that the soft tissue of a palm has over the breadth of a hand (data/grip_normal.yaml);
every use should show what another grip does (`loose`, `tight`, `GripStiffness.scaled`).
"""

import dataclasses
import math
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BallRpyJoint, Frame, Joint, LinearBushingRollPitchYaw
from pydrake.systems.framework import Context

from drake_racket.io.errors import InputError
from drake_racket.io.files import write_text
from drake_racket.io.shipped import data_directory
from drake_racket.io.yaml_files import load_file, name_or_path
from drake_racket.parameters.quantities import Quantities, check_fields, many
from drake_racket.plant.racket import Racket

GRIPS = ("loose", "normal", "tight")

GRIP_KINDS = ("compliant", "torsional", "weld")
"""Six spring-dampers; three torsional ones about a point that the hand holds; or rigid."""


@dataclass
class GripStiffness:
    """The six spring-dampers of a grip: lists of three, about or along x, y and z of the hand."""

    name: str = ""
    title: str = ""
    force_stiffness: Quantities = many("N/m", sign="non-negative", least=3)
    force_damping: Quantities = many("N*s/m", sign="non-negative", least=3)
    torque_stiffness: Quantities = many("N*m/rad", sign="non-negative", least=3)
    torque_damping: Quantities = many("N*m*s/rad", sign="non-negative", least=3)
    notes: list[str] = field(default_factory=list)

    def scaled(self, factor: float, damping_factor: float | None = None) -> "GripStiffness":
        """All six stiffnesses times `factor`; the dampings times `damping_factor`.

        By default the dampings grow with the root of the stiffness, which keeps the damping ratio
        of a racket that moves as a rigid body in the hand.

        Raises:
            InputError: a factor is not a finite number of 0 or more.

        """
        if not (math.isfinite(factor) and factor >= 0.0):
            raise InputError("GripStiffness.scaled: factor", factor, "a finite number, 0 or more")
        by = math.sqrt(factor) if damping_factor is None else damping_factor
        if not (math.isfinite(by) and by >= 0.0):
            raise InputError(
                "GripStiffness.scaled: damping_factor", by, "a finite number, 0 or more"
            )
        return dataclasses.replace(
            self,
            force_stiffness=_times(self.force_stiffness, factor),
            force_damping=_times(self.force_damping, by),
            torque_stiffness=_times(self.torque_stiffness, factor),
            torque_damping=_times(self.torque_damping, by),
        )


def _times(values: Quantities, factor: float) -> Quantities:
    if factor == 1.0:
        return values
    scaled = [factor * x for x in values.value]
    return Quantities(scaled, values.unit, "inferred", f"{factor:g} times: {values.source}")


def load_grip(grip: str | os.PathLike[str] = "normal") -> GripStiffness:
    """Loads the shipped grip by name, or any grip from its YAML file.

    Raises:
        InputError: unknown name, unreadable file, or content that does not fit.

    """
    grip = name_or_path(grip, "grip")
    if grip.endswith((".yaml", ".yml")):
        path = Path(grip)
    elif grip in GRIPS:
        path = data_directory() / f"grip_{grip}.yaml"
    else:
        raise InputError("grip", grip, f"{', '.join(GRIPS)} or a path ending in .yaml")
    loaded = load_file(path, GripStiffness, complete=True)
    check_grip(loaded, str(path))
    return loaded


def write_grip(grip: GripStiffness, path: Path) -> None:
    """Writes a grip's file, for `load_grip` and scenarios.

    Raises:
        InputError: the grip is not valid.

    """
    check_grip(grip)
    text = yaml.safe_dump(dataclasses.asdict(grip), sort_keys=False, allow_unicode=True)
    write_text(text, path)


def check_grip(grip: GripStiffness, where: str = "grip") -> None:
    """Checks units, signs, counts and provenance; raises InputError."""
    check_fields(grip, where)
    for item in dataclasses.fields(grip):
        values = getattr(grip, item.name)
        if isinstance(values, Quantities) and len(values.value) != 3:
            raise InputError(f"{where}: {item.name}.value", values.value, "3 numbers: x, y, z")


@dataclass(frozen=True)
class Grip:
    """Handles to a grip in a plant.

    Attributes:
        kind: one of GRIP_KINDS.
        hand_frame: H, on whatever holds the racket.
        racket_frame: G, on the racket; it lies on H at rest.
        bushing: its roll, pitch and yaw are those of G in H; None for a weld.
        joint: the weld or ball joint from H to G; None for a compliant grip.

    """

    plant: MultibodyPlant
    kind: str
    hand_frame: Frame
    racket_frame: Frame
    bushing: LinearBushingRollPitchYaw | None
    joint: Joint | None

    def set_stiffness(self, root: Context, grip: GripStiffness) -> None:
        """Writes another grip into a Context: the plant's, or one of a Diagram that holds it.

        A weld has no stiffness: nothing to write. A GripLoad holds the constants by itself:
        `set_grip_load_parameters` copies them there.

        Raises:
            InputError: the grip is not valid.

        """
        check_grip(grip)
        if self.bushing is None:
            return
        torque_k, torque_c, force_k, force_c = _constants(grip, self.kind)
        context = self.plant.GetMyMutableContextFromRoot(root)
        self.bushing.SetTorqueStiffnessConstants(context, torque_k)
        self.bushing.SetTorqueDampingConstants(context, torque_c)
        self.bushing.SetForceStiffnessConstants(context, force_k)
        self.bushing.SetForceDampingConstants(context, force_c)


def _constants(grip: GripStiffness, kind: str) -> list[list[float]]:
    """Torque stiffness and damping, force stiffness and damping of the bushing."""
    forces = [grip.force_stiffness.value, grip.force_damping.value]
    if kind == "torsional":  # the joint holds the point
        forces = [[0.0] * 3, [0.0] * 3]
    return [grip.torque_stiffness.value, grip.torque_damping.value, *forces]


def add_grip(
    plant: MultibodyPlant,
    racket: Racket,
    hand_frame: Frame,
    grip: GripStiffness,
    *,
    kind: str = "compliant",
    held_at: str = "grip",
) -> Grip:
    """Holds a racket that was added free at `hand_frame`. Before `Finalize`.

    A compliant grip only pulls the two frames together: put the racket where its grip frame lies on
    the hand frame (`plant.SetFreeBodyPose` of the handle) for a start without force. The other two
    make the racket part of the hand's tree.

    Args:
        kind: one of GRIP_KINDS.
        held_at: the racket's frame that lies in the hand: grip, butt, ...

    Raises:
        InputError: the plant is finalized, the grip or the kind is not valid, or the frame is
            unknown.

    """
    if plant.is_finalized():
        raise InputError("add_grip: plant", "finalized", "a plant before Finalize()")
    if kind not in GRIP_KINDS:
        raise InputError("add_grip: kind", kind, ", ".join(GRIP_KINDS))
    check_grip(grip)
    racket_frame = racket.frame(held_at)
    joint: Any = None
    bushing: Any = None
    if kind == "weld":
        joint = plant.WeldFrames(hand_frame, racket_frame)
    elif kind == "torsional":
        name = f"{plant.GetModelInstanceName(racket.model_instance)}_grip"
        joint = plant.AddJoint(BallRpyJoint(name, hand_frame, racket_frame))
    if kind != "weld":
        constants: list[Any] = _constants(grip, kind)
        bushing = plant.AddForceElement(
            LinearBushingRollPitchYaw(hand_frame, racket_frame, *constants)
        )
    return Grip(plant, kind, hand_frame, racket_frame, bushing, joint)
