"""Reads the file of the shipped upper limb: segments, joints, and how they scale.

Segments are those of de Leva (1996), Adjustments to Zatsiorsky-Seluyanov's segment inertia
parameters, J. Biomech. 29(9):1223-1230, Table 4. A segment's sagittal axis runs from back to front
and its transverse axis from side to side in the anatomical position (arm hanging, palm forward).
"""

import dataclasses
import math
import os
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError
from drake_racket.io.numbers import finite_number
from drake_racket.io.schema import Schema, Text, read, shown
from drake_racket.io.yaml_files import load_file, shipped_or_path
from drake_racket.parameters.quantities import Of, Quantity, check_name

UPPER_LIMBS = ("upper_limb",)
SEGMENTS = ("upper_arm", "forearm", "hand")
"""Names of the shipped limb's segments, from the shoulder to the hand."""
JOINTS = (
    "shoulder_abduction",
    "shoulder_flexion",
    "shoulder_rotation",
    "elbow_flexion",
    "forearm_pronation",
    "wrist_flexion",
    "wrist_deviation",
)
"""The limb has these joints from trunk to hand, each named after its positive direction."""


@dataclass(frozen=True)
class Subject(Schema):
    """The subject is whose limb it is."""

    mass: Annotated[Quantity, Of("kg")]
    height: Annotated[Quantity, Of("m")]


@dataclass(frozen=True)
class Segment(Schema):
    """Holds one rigid segment, from its proximal to its distal joint centre."""

    length: Annotated[Quantity, Of("m")]
    mass_fraction: Annotated[Quantity, Of("1")]  # of the body's mass
    com: Annotated[Quantity, Of("1")]  # from the proximal end, of the length
    gyration_sagittal: Annotated[
        Quantity, Of("1")
    ]  # radii of gyration about the COM, of the length
    gyration_transverse: Annotated[Quantity, Of("1")]
    gyration_longitudinal: Annotated[Quantity, Of("1")]


@dataclass(frozen=True)
class GripPlace(Schema):
    """Says where the racket's grip frame lies in the fist."""

    distal: Annotated[Quantity, Of("m")]  # from the wrist along the hand
    palmar: Annotated[Quantity, Of("m", sign="non-negative")]  # from there out of the palm
    inclination: Annotated[Quantity, Of("rad", sign="any")]  # butt to tip, from radial


@dataclass(frozen=True)
class JointParameters(Schema):
    """Holds one joint: its range of motion, its damping, and the stiffness of the range's ends.

    `active_stiffness` and `active_damping` are those of its muscles at full activation about the
    posture that they hold; none where they are left out.
    """

    lower: Annotated[Quantity, Of("rad", sign="any")]
    upper: Annotated[Quantity, Of("rad", sign="any")]
    damping: Annotated[Quantity, Of("N*m*s/rad", sign="non-negative")]
    limit_stiffness: Annotated[Quantity, Of("N*m/rad", sign="non-negative")]
    active_stiffness: Annotated[Quantity, Of("N*m/rad", sign="non-negative")] | None = None
    active_damping: Annotated[Quantity, Of("N*m*s/rad", sign="non-negative")] | None = None

    def active(self) -> tuple[float, float]:
        """Gives stiffness (N m/rad) and damping (N m s/rad) of fully active muscles."""
        pair = self.active_stiffness, self.active_damping
        stiffness, damping = (0.0 if q is None else q.value for q in pair)
        return stiffness, damping


@dataclass(frozen=True)
class JointSet(Schema):
    """Holds the seven joints."""

    shoulder_abduction: JointParameters
    shoulder_flexion: JointParameters
    shoulder_rotation: JointParameters
    elbow_flexion: JointParameters
    forearm_pronation: JointParameters
    wrist_flexion: JointParameters
    wrist_deviation: JointParameters


@dataclass(frozen=True, repr=False)
class UpperLimbParameters(Schema):
    """The parameters are the whole content of one file of an upper limb.

    Attributes:
        name: letters, digits and _.
        title: for people.
        subject: mass (kg) and height (m) of the body whose limb it is.
        upper_arm, forearm, hand: the segments.
        grip: where the handle lies in the fist.
        joints: ranges (rad) and the stiffness at their ends (N m/rad).
        limit_damping: s/rad, on the torques at the ends of the ranges.
        notes: what a reader should know.

    """

    name: Text
    title: Text
    subject: Subject
    upper_arm: Segment
    forearm: Segment
    hand: Segment
    grip: GripPlace
    joints: JointSet
    limit_damping: Annotated[Quantity, Of("s/rad", sign="non-negative")]
    notes: tuple[Text, ...]

    def __repr__(self) -> str:
        """Shows name and title."""
        return shown(self, f"{self.name}: {self.title}")

    def segment(self, name: str) -> Segment:
        """Gives the segment `upper_arm`, `forearm` or `hand`."""
        found: Segment = getattr(self, name)
        return found

    def joint(self, name: str) -> JointParameters:
        """Gives one of the `JOINTS`."""
        found: JointParameters = getattr(self.joints, name)
        return found

    def mass(self, name: str) -> float:
        """Gives a segment's mass (kg)."""
        return self.segment(name).mass_fraction.value * self.subject.mass.value

    def com(self, name: str) -> float:
        """Gives the distance (m) of a segment's centre of mass from its proximal end."""
        return self.segment(name).com.value * self.segment(name).length.value

    def moments(self, name: str) -> tuple[float, float, float]:
        """Gives a segment's moments of inertia (kg m^2) about its centre of mass, m (r l)^2.

        About its sagittal, transverse and longitudinal axis.
        """
        segment = self.segment(name)
        radii = (
            segment.gyration_sagittal.value,
            segment.gyration_transverse.value,
            segment.gyration_longitudinal.value,
        )
        s, t, l = (self.mass(name) * (r * segment.length.value) ** 2 for r in radii)
        return s, t, l

    def ranges(self) -> NDArray[np.float64]:
        """Gives the ends (rad) of the joints' ranges, (7, 2), in the order of `JOINTS`."""
        joints = [self.joint(name) for name in JOINTS]
        return np.array([(joint.lower.value, joint.upper.value) for joint in joints])


def load_upper_limb(
    limb: str | os.PathLike[str] = "upper_limb",
    *,
    mass: float | None = None,
    height: float | None = None,
) -> UpperLimbParameters:
    """Loads the shipped upper limb, or one from its YAML file, for a subject of any size.

    Args:
        limb: `upper_limb`, or a path ending in .yaml.
        mass: the subject's mass (kg); the segments' masses keep their fractions of it.
        height: the subject's height (m); all lengths of the file grow with it. The moments of
            inertia follow both.

    Raises:
        InputError: unknown name, unreadable file, content that does not fit, or a mass or height
            that is not a finite positive number.

    """
    path = shipped_or_path(limb, "limb", UPPER_LIMBS)
    loaded = load_file(path, UpperLimbParameters)
    _check_whole(loaded, str(path))
    return _scaled(loaded, _size("mass", mass), _size("height", height))


def _size(key: str, value: float | None) -> float | None:
    """A subject's mass or height as a Python float: SDF is written from it."""
    if value is None:
        return None
    allowed = "a finite number above 0"
    number = finite_number(f"load_upper_limb: {key}", value, allowed)
    if not number > 0.0:
        raise InputError(f"load_upper_limb: {key}", value, allowed)
    return number


def _scaled(
    limb: UpperLimbParameters, mass: float | None, height: float | None
) -> UpperLimbParameters:
    subject = limb.subject
    if mass is not None:
        source = f"the subject's; the file's subject has {subject.mass.value:g} kg"
        subject = dataclasses.replace(subject, mass=Quantity(mass, "kg", "measured", source))
    if height is not None:
        factor = height / subject.height.value
        source = f"the subject's; the file's subject has {subject.height.value:g} m"
        subject = dataclasses.replace(subject, height=Quantity(height, "m", "measured", source))
        parts = {
            name: dataclasses.replace(
                limb.segment(name), length=_times(limb.segment(name).length, factor)
            )
            for name in SEGMENTS
        }
        grip = dataclasses.replace(
            limb.grip,
            distal=_times(limb.grip.distal, factor),
            palmar=_times(limb.grip.palmar, factor),
        )
        limb = dataclasses.replace(limb, **parts, grip=grip)  # type: ignore[arg-type]
    return dataclasses.replace(limb, subject=subject)


def _times(length: Quantity, factor: float) -> Quantity:
    """A length scaled; one that was inferred stays so."""
    if factor == 1.0:
        return length
    status = "inferred" if length.status == "inferred" else "calculated"
    return Quantity(
        factor * length.value, length.unit, status, f"{factor:.6g} (height) times: {length.source}"
    )


def check_upper_limb(limb: UpperLimbParameters, where: str = "upper_limb") -> None:
    """Checks units, signs, provenance, inertias and ranges; raises InputError."""
    _check_whole(read(limb, UpperLimbParameters, where), where)


def _check_whole(limb: UpperLimbParameters, where: str) -> None:
    """What no single value shows."""
    check_name(limb.name, where)
    for name in SEGMENTS:
        segment = limb.segment(name)
        for key in ("mass_fraction", "com"):
            fraction: Quantity = getattr(segment, key)
            if fraction.value > 1.0:
                raise InputError(f"{where}: {name}.{key}.value", fraction.value, "at most 1")
        low, middle, high = sorted(limb.moments(name))
        if high > low + middle:
            raise InputError(
                f"{where}: {name}.gyration_*",
                [low, middle, high],
                "no moment of inertia above the others' sum",
            )
    if abs(limb.grip.inclination.value) >= 0.5 * math.pi:
        raise InputError(
            f"{where}: grip.inclination.value", limb.grip.inclination.value, "within pi/2 of 0"
        )
    for name in JOINTS:
        joint = limb.joint(name)
        if not joint.lower.value < joint.upper.value:
            raise InputError(
                f"{where}: joints.{name}.lower.value",
                joint.lower.value,
                f"below upper, {joint.upper.value}",
            )
