"""The part of a scenario that says which limb holds the racket, and in which stroke.

Drake's typed YAML reads the annotations of this class as types: they are not postponed here.
"""

from dataclasses import dataclass, field

from drake_racket.io.errors import InputError
from drake_racket.io.numbers import number_between, plain_numbers
from drake_racket.limbs.torques import JOINT_TORQUES
from drake_racket.parameters.stroke import Stroke, check_stroke


@dataclass
class LimbSettings:
    """A limb, where it stands, and what it does. SI units; angles in degrees, as their names say.

    Attributes:
        model: `upper_limb` (the shipped one), or the path of an SDF, URDF or model directives file
            (`.dmd.yaml`).
        side: of the shipped limb, right or left.
        mass, height: of the shipped limb's subject (kg, m); 0 for those of its file.
        grip_rotation_deg: of the shipped limb's racket about its own axis in the fist.
        place, trunk_azimuth_deg: of the shoulder (or of `base`) in the world (m): where it is, and
            its heading, from x (towards the net) towards y (left).
        base: of a file's limb, the frame that is welded to the world; empty if the file does that.
        hand: of a file's limb, the frame on which the racket's grip frame lies.
        limits: passive torques at the ends of the shipped limb's ranges.
        joint_torques: during the impact: `zero`, `hold` or `carry`, constant; see `joint_torques`.
        stroke: place and motion of the racket at the start.

    """

    model: str = "upper_limb"
    side: str = "right"
    mass: float = 0.0
    height: float = 0.0
    grip_rotation_deg: float = 0.0
    place: list[float] = field(default_factory=lambda: [0.0, 0.0, 1.4])
    trunk_azimuth_deg: float = 0.0
    base: str = ""
    hand: str = "hand"
    limits: bool = True
    joint_torques: str = "hold"
    stroke: Stroke = field(default_factory=Stroke)

    def __post_init__(self) -> None:
        """Numbers become Python floats."""
        plain_numbers(self)

    def topology(self) -> tuple[object, ...]:
        """What a Diagram is built from; the stroke and the torques are set in its Context."""
        subject = (self.side, self.mass, self.height, self.grip_rotation_deg)
        place = (*self.place, self.trunk_azimuth_deg)
        return (self.model, *subject, place, self.base, self.hand, self.limits)


def check_limb_settings(settings: LimbSettings, where: str = "limb") -> None:
    """Checks every value but names that need the model; raises InputError.

    Numbers that were set after the settings were made become Python floats.
    """
    plain_numbers(settings)
    for key, kind, text in (
        ("model", str, "a text"),
        ("base", str, "a text"),
        ("hand", str, "a text"),
        ("limits", bool, "true or false"),
        ("stroke", Stroke, "a stroke"),
    ):
        if not isinstance(getattr(settings, key), kind):
            raise InputError(f"{where}.{key}", getattr(settings, key), text)
    if settings.side not in ("right", "left"):
        raise InputError(f"{where}.side", settings.side, "right, left")
    if settings.joint_torques not in JOINT_TORQUES:
        raise InputError(f"{where}.joint_torques", settings.joint_torques, ", ".join(JOINT_TORQUES))
    if not isinstance(settings.place, list) or len(settings.place) != 3:
        raise InputError(f"{where}.place", settings.place, "three numbers (m)")
    for key, values, most in (
        ("place", settings.place, 100.0),
        ("grip_rotation_deg", [settings.grip_rotation_deg], 360.0),
        ("trunk_azimuth_deg", [settings.trunk_azimuth_deg], 360.0),
    ):
        for value in values:
            number_between(f"{where}.{key}", value, -most, most)
    number_between(f"{where}.mass", settings.mass, 0.0, 300.0)
    number_between(f"{where}.height", settings.height, 0.0, 3.0)
    check_stroke(settings.stroke, f"{where}.stroke")
