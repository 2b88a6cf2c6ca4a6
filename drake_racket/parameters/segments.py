"""Cuts a racket's frame into segments and gives the joints between them.

Two segments are the published parts (Glynn et al. 2011); more are cut from a distribution of mass
and stiffness along the racket, which keeps what is known of the parts: `laws.flexure`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError
from drake_racket.laws.densities import hoop_density, mixed, smooth_density
from drake_racket.laws.flexure import (
    PartMass,
    Slice,
    boundaries,
    compliances,
    cut,
    ellipse_width,
    free_frequencies,
    joint_stiffness,
)
from drake_racket.parameters.frame import (
    BENDING_AXES,
    TORSION,
    FrameDistribution,
    FrameJoint,
    FrameSegment,
    Part,
    ThroatJoint,
)
from drake_racket.parameters.quantities import Quantity
from drake_racket.parameters.string_bed import StringBedParameters

FEWEST_SEGMENTS, MOST_SEGMENTS = 2, 12


class Framed(Protocol):
    """A framed thing is what a frame is cut from: `RacketParameters`."""

    @property
    def handle(self) -> Part:
        """The part from the butt to the throat joint."""

    @property
    def head(self) -> Part:
        """The part from the throat joint to the tip."""

    @property
    def throat_joint(self) -> ThroatJoint:
        """The two spring-dampers of the published model."""

    @property
    def string_bed(self) -> StringBedParameters:
        """The string-bed: where its centre and its rim are."""

    @property
    def frame(self) -> FrameDistribution:
        """What lies along the frame."""


def segments_of(racket: Framed) -> tuple[FrameSegment, ...]:
    """Gives the segments of a racket's frame, from the butt."""
    throat = racket.handle.length.value
    length = throat + racket.head.length.value
    if is_published(racket):
        parts = zip(("handle", "head"), (racket.handle, racket.head), (0.0, throat), strict=True)
        return tuple(
            FrameSegment(
                name=name,
                start=start,
                end=throat if name == "handle" else length,
                origin=start,
                mass=part.mass.value,
                com=part.centre()[0],
                com_y=part.centre()[1],
                moments=part.moments(),
                product=part.product(),
            )
            for name, part, start in parts
        )
    slices = frame_slices(racket)
    carrier = segment_at(slices, throat + racket.string_bed.gsc.value)
    found = []
    for i, piece in enumerate(slices):
        name = "handle" if i == 0 else "head" if i == carrier else f"segment_{i + 1}"
        origin = throat if i == carrier else piece.start
        found.append(
            FrameSegment(
                name=name,
                start=piece.start,
                end=piece.end,
                origin=origin,
                mass=piece.mass,
                com=piece.com - origin,
                com_y=piece.com_y,
                moments=piece.moments(),
                product=-piece.xy,
            )
        )
    return tuple(found)


def is_published(racket: Framed) -> bool:
    """Tells whether a frame is its file's two parts, with nothing cut from a distribution."""
    return racket.frame.count() == 2 and racket.frame.density.value == 0.0


def need_two(racket: Framed, where: str) -> None:
    """Refuses a frame of more than the two segments that one joint a plane belongs to.

    Raises:
        InputError: naming `where`.

    """
    if racket.frame.count() != 2:
        raise InputError(
            where, f"a frame of {racket.frame.count()} segments", "one of two segments"
        )


def segment_at(segments: Sequence[Slice] | Sequence[FrameSegment], x: float) -> int:
    """Gives the number, from 0, of the segment that holds a place x (m from the butt)."""
    starts = [segment.start for segment in segments]
    return max(int(np.searchsorted(starts, x, side="right")) - 1, 0)


def joints_of(racket: Framed) -> tuple[FrameJoint, ...]:
    """Lists the joints of a racket's frame, in their order from the butt."""
    if racket.frame.idle:
        return tuple(
            FrameJoint(
                plane,
                axis,
                racket.handle.length.value,
                *racket.throat_joint.constants(plane),
            )
            for plane, axis in BENDING_AXES.items()
        )
    slices, frame = frame_slices(racket), racket.frame
    places = [slices[0].start, *(s.end for s in slices)]
    throat = racket.handle.length.value
    constants: dict[str, list[tuple[float, float]]] = {}
    for plane in BENDING_AXES:
        stiffness, damping = racket.throat_joint.constants(plane)
        k = bending_stiffness(racket, slices, plane)
        constants[plane] = [(x, x * damping / stiffness) for x in k.tolist()]
    axes = dict(BENDING_AXES)
    if frame.count() > 2:
        axes[TORSION] = "x"
        values = [frame.torsion_handle.value, frame.torsion_head.value]
        k = 1.0 / compliances(places, [throat], values)
        constants[TORSION] = [(x, x * frame.torsion_damping.value) for x in k.tolist()]
    return tuple(
        FrameJoint(
            plane if frame.count() == 2 else f"{plane}_{i + 1}",
            axis,
            place,
            *constants[plane][i],
            plane=plane,
            inner=i,
        )
        for i, place in enumerate(places[1:-1])
        for plane, axis in axes.items()
    )


def bending_stiffness(racket: Framed, slices: Sequence[Slice], plane: str) -> NDArray[np.float64]:
    """Gives the stiffness (N m/rad) of the joints of one plane between slices of a frame."""
    places = [slices[0].start, *(s.end for s in slices)]
    taper: Quantity = getattr(racket.frame, f"taper_{plane}")
    c = compliances(places, [racket.handle.length.value], [1.0, taper.value])
    return joint_stiffness(slices, plane, c, _fundamental(racket, plane))


def _fundamental(racket: Framed, plane: str) -> float:
    """The frequency (Hz) that a frame has whatever its number of segments."""
    given: Quantity | None = getattr(racket.frame, f"frequency_{plane}")
    if given is not None:
        return given.value
    parts = [_part_mass(racket, name, 0.0) for name in ("handle", "head")]
    throat = racket.handle.length.value
    two = cut(parts, [0.0, throat, throat + racket.head.length.value])
    stiffness, _ = racket.throat_joint.constants(plane)
    return float(free_frequencies(two, plane, np.array([stiffness]))[0])


def frame_slices(racket: Framed) -> list[Slice]:
    """Cuts the distribution of a racket's mass into its segments."""
    frame, throat = racket.frame, racket.handle.length.value
    length = throat + racket.head.length.value
    parts = [_part_mass(racket, name, frame.density.value) for name in ("handle", "head")]
    return cut(parts, boundaries(frame.count(), length, throat, frame.grip_boundary.value))


def _part_mass(racket: Framed, name: str, density: float) -> PartMass:
    """How the mass of a part lies, by the family that `density` chooses."""
    part: Part = getattr(racket, name)
    mass, length = part.mass.value, part.length.value
    com, com_y = part.centre()
    xx, yy, zz = second_moments(part)
    bed = racket.string_bed
    rim = bed.gsc.value, bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
    smooth = smooth_density(mass, length, com, xx)
    other = smooth
    if density > 0.0 and name == "handle":
        other = smooth_density(mass, length, com, None)
    elif density > 0.0:
        other = hoop_density(mass, length, com, rim)
    slope = -part.product() / xx
    return PartMass(
        start=0.0 if name == "handle" else racket.handle.length.value,
        length=length,
        density=mixed(smooth, other, density),
        com=com,
        com_y=com_y,
        slope=slope,
        yy=yy - slope * slope * xx,
        zz=zz,
        width=None if name == "handle" else ellipse_width(*rim),
    )


def second_moments(part: Part) -> tuple[float, float, float]:
    """Gives the integrals of x^2, y^2 and z^2 over a part's mass about its centre (kg m^2)."""
    along, across, normal = part.moments()
    return (
        0.5 * (across + normal - along),
        0.5 * (along + normal - across),
        0.5 * (along + across - normal),
    )


def check_frame(racket: Framed, where: str) -> None:
    """Checks a frame's distribution; raises InputError."""
    frame, key = racket.frame, f"{where}: frame"
    count = frame.segments.value
    if count != int(count) or not FEWEST_SEGMENTS <= count <= MOST_SEGMENTS:
        allowed = f"a whole number from {FEWEST_SEGMENTS} to {MOST_SEGMENTS}"
        raise InputError(f"{key}.segments.value", count, allowed)
    if frame.density.value > 1.0:
        raise InputError(f"{key}.density.value", frame.density.value, "0 to 1")
    length = racket.handle.length.value
    if not frame.grip_boundary.value < length:
        allowed = f"on the handle, which is {length:g} m long"
        raise InputError(f"{key}.grip_boundary.value", frame.grip_boundary.value, allowed)
    if is_published(racket):
        return
    for name in ("handle", "head"):
        _check_part(getattr(racket, name), name, where)
    try:
        frame_slices(racket)
    except ValueError as error:
        allowed = f"segments that all have mass ({error})"
        raise InputError(f"{key}.segments.value", int(count), allowed) from None


def _check_part(part: Part, name: str, where: str) -> None:
    """Whether a density along the part can have its mass, centre and moments."""
    xx, yy, _zz = second_moments(part)
    com, length = part.centre()[0], part.length.value
    most = part.mass.value * com * (length - com)
    if not 0.0 < xx < most:
        raise InputError(
            f"{where}: {name}.moi_*",
            list(part.moments()),
            f"moments that leave integral x^2 dm ({xx:.3g} kg m^2) between 0 and {most:.3g}:"
            " mass within the part's length",
        )
    if part.product() ** 2 > xx * yy:
        raise InputError(
            f"{where}: {name}.product_xy.value",
            part.product(),
            f"at most {(xx * max(yy, 0.0)) ** 0.5:.3g} in size, by the part's moments",
        )
