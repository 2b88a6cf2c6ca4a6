"""Describes a racket's frame: its two parts, what lies along them, its segments and joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated

from drake_racket.io.schema import Schema
from drake_racket.parameters.quantities import Choice, Named, Of, Quantity

JOINT_READINGS = ("by_axis", "as_printed")
"""How the labels of the paper's Table 2 can be read; see `ThroatJoint.labels`."""

AXES = ("x", "y", "z")

BENDING_AXES = {"in_plane": "z", "out_of_plane": "y"}
"""Plane of bending -> the axis it turns about; in the order of the joints from the butt."""

TORSION = "torsion"
"""Name of what turns about the racket's long axis; of more than two segments only."""


@dataclass(frozen=True)
class Part(Schema):
    """A part is one rigid body of the frame; its moments are about its centre of mass.

    `com_y` and `product_xy` are 0 where they are left out: the part is alike on both sides.
    """

    mass: Annotated[Quantity, Of("kg")]
    length: Annotated[Quantity, Of("m")]
    com: Annotated[Quantity, Of("m")]  # from the end nearest the butt
    moi_longitudinal: Annotated[Quantity, Of("kg*m^2")]  # about x
    moi_frontal: Annotated[Quantity, Of("kg*m^2")]  # about z, the normal of the string plane
    moi_transverse: Annotated[Quantity, Of("kg*m^2")]  # about y
    com_y: Annotated[Quantity, Of("m", sign="any")] | None = None  # from the long axis
    product_xy: Annotated[Quantity, Of("kg*m^2", sign="any")] | None = None  # minus integral of xy

    def centre(self) -> tuple[float, float]:
        """Gives the centre of mass (x, y) (m), from the end nearest the butt."""
        return self.com.value, self.com_y.value if self.com_y else 0.0

    def moments(self) -> tuple[float, float, float]:
        """Gives the moments (kg m^2) about the centre of mass, along x, y and z."""
        return self.moi_longitudinal.value, self.moi_transverse.value, self.moi_frontal.value

    def product(self) -> float:
        """Gives the product of inertia I_xy (kg m^2) about the centre of mass."""
        return self.product_xy.value if self.product_xy else 0.0


@dataclass(frozen=True)
class ThroatJoint(Schema):
    """The throat joint is two spring-dampers, labelled as the source prints."""

    reading: Annotated[Choice, Named(*JOINT_READINGS)]
    stiffness_in: Annotated[Quantity, Of("N*m/rad")]
    stiffness_out: Annotated[Quantity, Of("N*m/rad")]
    damping_in: Annotated[Quantity, Of("N*m*s/rad", sign="non-negative")]
    damping_out: Annotated[Quantity, Of("N*m*s/rad", sign="non-negative")]

    def labels(self) -> dict[str, str]:
        """Maps each plane of bending to the printed label that stands for it in this reading.

        `as_printed` takes the labels as directions of bending. `by_axis` takes them as the axis of
        rotation: "in" is rotation about the in-plane axis (y), which bends the racket out of its
        plane. Only `by_axis` gives the published frequencies.
        """
        printed = self.reading.value == "as_printed"
        return dict(zip(BENDING_AXES, ("in", "out") if printed else ("out", "in"), strict=True))

    def constants(self, plane: str) -> tuple[float, float]:
        """Gives stiffness (N m/rad) and damping (N m s/rad) of bending in one plane."""
        label = self.labels()[plane]
        stiffness: Quantity = getattr(self, f"stiffness_{label}")
        damping: Quantity = getattr(self, f"damping_{label}")
        return stiffness.value, damping.value

    def in_plane(self) -> tuple[float, float]:
        """Gives the `constants` of in-plane bending, about z."""
        return self.constants("in_plane")

    def out_of_plane(self) -> tuple[float, float]:
        """Gives the `constants` of out-of-plane bending, about y."""
        return self.constants("out_of_plane")


def _given(value: float, unit: str, source: str) -> Quantity:
    return field(default_factory=lambda: Quantity(value, unit, "inferred", source))


@dataclass(frozen=True)
class FrameDistribution(Schema):
    """The distribution says into how many segments a frame is cut, and what lies along it.

    With two segments and a density of 0 the frame is the published one: parts and throat joint as
    the file has them, and the other numbers here decide nothing.

    Attributes:
        segments: 2 to 12.
        density: 0: maximum entropy with the parts' masses, centres and moments; 1: exponential
            handle and elliptic hoop with their masses and centres; between: that mixture.
        grip_boundary: where the first of more than two segments ends: the upper edge of the grip.
        taper_in_plane, taper_out_of_plane: bending stiffness EI of the head over the handle's.
        torsion_handle, torsion_head: torsional stiffness GJ.
        torsion_damping: damping of the torsion joints over their stiffness.
        frequency_in_plane, frequency_out_of_plane: of the free, bare frame; None: what two
            segments have with the throat joint's stiffness.

    """

    segments: Annotated[Quantity, Of("1")] = _given(2.0, "1", "the published model: two parts")
    density: Annotated[Quantity, Of("1", sign="non-negative")] = _given(
        0.0, "1", "keeps the parts' printed moments of inertia"
    )
    grip_boundary: Annotated[Quantity, Of("m")] = _given(
        0.1, "m", "upper edge of the grip, so that a hand or a clamp holds one segment"
    )
    taper_in_plane: Annotated[Quantity, Of("1")] = _given(1.0, "1", "a uniform beam")
    taper_out_of_plane: Annotated[Quantity, Of("1")] = _given(1.0, "1", "a uniform beam")
    torsion_handle: Annotated[Quantity, Of("N*m^2")] = _given(
        60.0, "N*m^2", "order of magnitude of a carbon tube; no source at hand prints one"
    )
    torsion_head: Annotated[Quantity, Of("N*m^2")] = _given(
        240.0, "N*m^2", "four times the handle's: two tubes far apart"
    )
    torsion_damping: Annotated[Quantity, Of("s", sign="non-negative")] = _given(
        3.3e-5, "s", "as of the tour racket's out-of-plane bending, 0.03 over 910"
    )
    frequency_in_plane: Annotated[Quantity, Of("Hz")] | None = None
    frequency_out_of_plane: Annotated[Quantity, Of("Hz")] | None = None

    @property
    def idle(self) -> bool:
        """Tells whether the frame is the published one, where nothing here decides anything."""
        own = self.frequency_in_plane or self.frequency_out_of_plane
        return self.segments.value == 2.0 and self.density.value == 0.0 and own is None

    def count(self) -> int:
        """Gives the number of segments."""
        return int(self.segments.value)


@dataclass(frozen=True)
class FrameJoint:
    """A frame joint is a revolute joint with a torsional spring-damper, tau = -k q - d q'.

    Attributes:
        name: of the joint.  axis: `x`, `y` or `z` of the racket.
        place: along the racket, m from the butt.
        stiffness: N m/rad.  damping: N m s/rad.
        plane: `in_plane`, `out_of_plane` or `torsion`; the name if it is left out.
        inner: number of the segment on its butt side, from 0; the next is on the other.

    """

    name: str
    axis: str
    place: float
    stiffness: float
    damping: float
    plane: str = ""
    inner: int = 0

    def __post_init__(self) -> None:
        """A single joint of a plane is named after it."""
        object.__setattr__(self, "plane", self.plane or self.name)

    @property
    def axis_index(self) -> int:
        """Gives 0, 1, 2 for x, y, z: the joint's place among roll, pitch and yaw."""
        return AXES.index(self.axis)


@dataclass(frozen=True)
class FrameSegment:
    """A frame segment is one rigid body of the frame.

    Attributes:
        name: of its body: `handle` at the butt, `head` where the string-bed's centre is, else
            `segment_2` and so on.
        start, end: m from the butt.
        origin: of the body's frame, m from the butt: the head's is at the throat joint.
        mass: kg.  com, com_y: centre of mass from the origin (m).
        moments: about it along x, y and z (kg m^2).  product: I_xy about it (kg m^2).

    """

    name: str
    start: float
    end: float
    origin: float
    mass: float
    com: float
    com_y: float
    moments: tuple[float, float, float]
    product: float


def bushing_constants(joints: Sequence[FrameJoint]) -> tuple[list[float], list[float]]:
    """Gives torque stiffness (N m/rad) and damping (N m s/rad) in roll, pitch and yaw.

    0 without a joint.

    Roll, pitch and yaw are the joints' angles if the joints turn about z, then y, then x.
    """
    stiffness, damping = [0.0] * 3, [0.0] * 3
    for joint in joints:
        stiffness[joint.axis_index], damping[joint.axis_index] = joint.stiffness, joint.damping
    return stiffness, damping
