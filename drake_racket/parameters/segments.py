"""Cuts a racket's frame into segments and gives the joints between them.

Two segments are the published parts (Glynn et al. 2011); more are cut from a distribution of mass
and stiffness along the racket, which keeps what is known of the parts: `laws.flexure`.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
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
    tilted_stiffness,
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

FEWEST_SEGMENTS, MOST_SEGMENTS = 2, 12
FINE = 24
"""Slices whose second frequency is the beam's to 0.2 % (tests)."""


class Rimmed(Protocol):
    """A rimmed thing has a string-bed's centre and rim: `StringBedParameters`."""

    @property
    def gsc(self) -> Quantity:
        """Its centre, m from the throat joint."""

    @property
    def rim_semi_axis_x(self) -> Quantity:
        """Of the rim's ellipse, along the racket (m)."""

    @property
    def rim_semi_axis_y(self) -> Quantity:
        """Of the rim's ellipse, across the racket (m)."""


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
    def string_bed(self) -> Rimmed:
        """The string-bed: where its centre and its rim are."""

    @property
    def frame(self) -> FrameDistribution:
        """What lies along the frame."""


@dataclass(frozen=True)
class _Rim:
    """Where centre and rim of a bed are; see Rimmed."""

    gsc: Quantity
    rim_semi_axis_x: Quantity
    rim_semi_axis_y: Quantity


@dataclass(frozen=True)
class _Frame:
    """What a frame is cut from, and nothing else: a key of what was cut before."""

    handle: Part
    head: Part
    throat_joint: ThroatJoint
    string_bed: _Rim
    frame: FrameDistribution


def _frame_of(racket: Framed) -> _Frame:
    bed = racket.string_bed
    rim = _Rim(bed.gsc, bed.rim_semi_axis_x, bed.rim_semi_axis_y)
    return _Frame(racket.handle, racket.head, racket.throat_joint, rim, racket.frame)


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
    return _joints(_frame_of(racket))


@functools.lru_cache(maxsize=64)
def _joints(racket: _Frame) -> tuple[FrameJoint, ...]:
    """The joints of a frame that is cut from a distribution."""
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
    """Gives the stiffness (N m/rad) of the joints of one plane between slices of a frame.

    Of three or more segments the second frequency is that of FINE ones, as near as they come.
    """
    taper: Quantity = getattr(racket.frame, f"taper_{plane}")
    throat = racket.handle.length.value
    first, c = _fundamental(racket, plane), _compliances(slices, throat, taper.value)
    if not 2 < len(slices) < FINE:
        return joint_stiffness(slices, plane, c, first)
    second = first * _second_over_first(racket, plane, taper.value)
    return tilted_stiffness(slices, plane, c, first, second)


def _compliances(slices: Sequence[Slice], throat: float, taper: float) -> NDArray[np.float64]:
    """The integrals of dx/g between the middles of slices."""
    places = [slices[0].start, *(s.end for s in slices)]
    return compliances(places, [throat], [1.0, taper])


def _second_over_first(racket: Framed, plane: str, taper: float) -> float:
    """Ratio of the first two frequencies of a frame in FINE slices of one length."""
    fine, throat = _fine_slices(_frame_of(racket)), racket.handle.length.value
    first, second, *_ = free_frequencies(fine, plane, 1.0 / _compliances(fine, throat, taper))
    return float(second / first)


@functools.lru_cache(maxsize=64)
def _fine_slices(racket: _Frame) -> tuple[Slice, ...]:
    """A frame in FINE slices of one length, for both planes."""
    parts = _parts_of(racket, racket.frame.density.value)
    length = racket.handle.length.value + racket.head.length.value
    places = np.linspace(0.0, length, FINE + 1).tolist()
    return tuple(cut(parts, _with_mass(parts, places)))


def _with_mass(parts: Sequence[PartMass], places: list[float]) -> list[float]:
    """Places without those that only a piece of no mass, at an end, lies before."""
    rows = zip(*(part.slices(places) for part in parts), strict=True)
    full = [any(piece is not None for piece in row) for row in rows]
    kept = [places[0]] + [end for end, some in zip(places[1:], full, strict=True) if some]
    return [*kept[:-1], places[-1]]


def _fundamental(racket: Framed, plane: str) -> float:
    """The frequency (Hz) that a frame has whatever its number of segments."""
    given: Quantity | None = getattr(racket.frame, f"frequency_{plane}")
    if given is not None:
        return given.value
    parts = _parts_of(racket, 0.0)
    throat = racket.handle.length.value
    two = cut(parts, [0.0, throat, throat + racket.head.length.value])
    stiffness, _ = racket.throat_joint.constants(plane)
    return float(free_frequencies(two, plane, np.array([stiffness]))[0])


def frame_slices(racket: Framed) -> list[Slice]:
    """Cuts the distribution of a racket's mass into its segments."""
    return list(_slices(_frame_of(racket)))


@functools.lru_cache(maxsize=64)
def _slices(racket: _Frame) -> tuple[Slice, ...]:
    frame, throat = racket.frame, racket.handle.length.value
    length = throat + racket.head.length.value
    parts = _parts_of(racket, frame.density.value)
    places = boundaries(frame.count(), length, throat, frame.grip_boundary.value)
    return tuple(cut(parts, places))


def _parts_of(racket: Framed, density: float) -> list[PartMass]:
    """How the mass of handle and head lies, by the family that `density` chooses."""
    bed = racket.string_bed
    rim = bed.gsc.value, bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
    throat = racket.handle.length.value
    return [
        _part_mass(racket.handle, None, 0.0, density),
        _part_mass(racket.head, rim, throat, density),
    ]


def _part_mass(
    part: Part, rim: tuple[float, float, float] | None, start: float, density: float
) -> PartMass:
    """How the mass of a part lies; the rim is that of the head, None for a handle."""
    mass, length = part.mass.value, part.length.value
    com, com_y = part.centre()
    xx, yy, zz = second_moments(part)
    smooth = smooth_density(mass, length, com, xx)
    other = smooth
    if density > 0.0 and rim is None:
        other = smooth_density(mass, length, com, None)
    elif density > 0.0 and rim is not None:
        other = hoop_density(mass, length, com, rim)
    slope = -part.product() / xx
    return PartMass(
        start=start,
        length=length,
        density=mixed(smooth, other, density),
        com=com,
        com_y=com_y,
        slope=slope,
        yy=yy - slope * slope * xx,
        zz=zz,
        width=None if rim is None else ellipse_width(*rim),
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
