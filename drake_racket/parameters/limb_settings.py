"""Limb settings say, in a scenario, which limb holds the racket, and in which stroke."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from drake_racket.io.numbers import plain_numbers
from drake_racket.io.schema import Flag, Number, OneOf, Schema, Text, Three, Vector, shown_changes
from drake_racket.parameters.stroke import Stroke

JOINT_TORQUES = ("zero", "hold", "carry")
"""This is what the limb's muscles do during the impact; see `limbs.torques`."""


@dataclass(frozen=True, repr=False)
class LimbSettings(Schema):
    """The settings say which limb, where it stands, and what it does; angles in degrees.

    Attributes:
        model: `upper_limb` (the shipped one), or the path of an SDF, URDF or model directives file
            (`.dmd.yaml`), of a MuJoCo model (`.xml`, `.mjb`) or an OpenSim model (`.osim`).
        side: of the shipped limb, right or left.
        mass: of the shipped limb's subject (kg); 0 for that of its file.
        height: of the shipped limb's subject (m); 0 for that of its file.
        grip_rotation_deg: of the shipped limb's racket about its own axis in the fist.
        place: of the shoulder (or of `base`) in the world (m).
        trunk_azimuth_deg: heading of the shoulder (or of `base`) in the world, from x (towards the
            net) towards y (left).
        base: of a file's limb, the frame that is welded to the world at `place`; empty if the file
            does that. Of MuJoCo and OpenSim the body from which on the model is taken.
        hand: of a file's limb, the frame (MuJoCo: body or site) on which the racket's grip frame
            lies.
        locked: joints that do not move; `others` stands for all off the chain to the hand.
        initial_deg: where joints off the chain start, and at which value joints are locked
            (degrees; metres at a prismatic joint); else where the model has them.
        packages: name -> folder, of `package://name/` in a file.
        keyframe: of a MuJoCo model, the posture that its joints start in, by name or number.
        limits: passive torques at the ends of the shipped limb's ranges.
        joint_torques: during the impact: `zero`, `hold` or `carry`, constant; see `limbs.torques`.
        activation: of the shipped limb's muscles, 0 to 1: that share of the joints' active
            stiffness and damping acts about the posture at the start, beside `joint_torques`.
        stroke: place and motion of the racket at the start.

    """

    model: Text = "upper_limb"
    side: Annotated[str, OneOf("right", "left")] = "right"
    mass: Annotated[float, Number("kg", 0.0, 300.0)] = 0.0
    height: Annotated[float, Number("m", 0.0, 3.0)] = 0.0
    grip_rotation_deg: Annotated[float, Number("degrees", -360.0, 360.0)] = 0.0
    place: Annotated[Vector, Three("m", 100.0)] = (0.0, 0.0, 1.4)
    trunk_azimuth_deg: Annotated[float, Number("degrees", -360.0, 360.0)] = 0.0
    base: Text = ""
    hand: Text = "hand"
    locked: tuple[Text, ...] = ()
    initial_deg: dict[Text, Annotated[float, Number("degrees", -1e4, 1e4)]] = field(
        default_factory=dict
    )
    packages: dict[Text, Text] = field(default_factory=dict)
    keyframe: Text = ""
    limits: Flag = True
    joint_torques: Annotated[str, OneOf(*JOINT_TORQUES)] = "hold"
    activation: Annotated[float, Number("1", 0.0, 1.0)] = 0.0
    stroke: Stroke = field(default_factory=Stroke)

    def __post_init__(self) -> None:
        """Numbers become Python floats."""
        plain_numbers(self)

    def __repr__(self) -> str:
        """Shows what differs from the defaults."""
        return shown_changes(self)

    def topology(self) -> tuple[object, ...]:
        """Tells what a Diagram is built from; stroke and torques are set in its Context."""
        subject = (self.side, self.mass, self.height, self.grip_rotation_deg)
        place = (*self.place, self.trunk_azimuth_deg)
        joints = (self.locked, tuple(sorted(self.initial_deg.items())), self.keyframe)
        packages = tuple(sorted(self.packages.items()))
        model = (self.model, self.base, self.hand, *joints, packages)
        return (*model, *subject, place, self.limits, self.activation > 0.0)
