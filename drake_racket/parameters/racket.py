"""The racket file has one frame with one string-bed (`string_bed`); here it is read and checked.

Every number carries unit, status and source (see `quantities`). The published values are those of
Glynn, King & Mitchell (2011), Sports Engineering 13(2):65-72, doi:10.1007/s12283-010-0056-x.

Frames. R: origin on the butt end, x from butt to tip, z normal to the string plane, y = z x x.
The points of the string-bed are numbered row by row as seen from +z with the tip up, so that +y is
on the left. Of nine, 1 2 3 are at the tip, 4 5 6 run through the geometric string-bed centre (5),
and 7 8 9 are at the throat.
"""

import dataclasses
import functools
import math
import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from drake_racket.io.errors import InputError
from drake_racket.io.notebooks.tables import html_table
from drake_racket.io.numbers import FrozenDict
from drake_racket.io.schema import Number, Schema, Text, check_fields, read, shown
from drake_racket.io.shipped import data_directory
from drake_racket.io.units import measure
from drake_racket.io.yaml_files import load_file, name_or_path
from drake_racket.laws.bed import BedTopology, grid_topology
from drake_racket.parameters.frame import (
    JOINT_READINGS,
    FrameDistribution,
    FrameJoint,
    FrameSegment,
    Part,
    ThroatJoint,
)
from drake_racket.parameters.quantities import (
    Choice,
    Of,
    Quantities,
    Quantity,
    Spread,
    check_name,
    sourced_rows,
)
from drake_racket.parameters.segments import check_frame, joints_of, segments_of
from drake_racket.parameters.string_bed import (
    FrictionParameters,
    StringBedParameters,
    check_friction,
    check_springs,
)

RACKETS = ("tour", "recreational")
"""Names of the shipped rackets, for `load_racket`."""
TENSIONS = ("low", "high")
"""Names of the two published tensions of each shipped racket."""
ROUNDING = 1e-12
"""Of a flat body's moments, by which the largest may exceed the sum of the others."""


@dataclass(frozen=True)
class Landmarks(Schema):
    """The landmarks are named places on the handle, from the butt along x."""

    grip: Annotated[Quantity, Of("m", sign="non-negative")]
    accelerometer: Annotated[Quantity, Of("m", sign="non-negative")]


@dataclass(frozen=True)
class AddedMass(Schema):
    """An added mass is a record of what was stuck onto the frame: lead tape, a weight in the butt.

    `mass` in kg; `x`, `y` (m) from the butt and from the long axis (+y is at 9 o'clock).
    """

    mass: Annotated[float, Number("kg")]
    x: Annotated[float, Number("m")]
    y: Annotated[float, Number("m")]
    at: Text = ""  # as it was asked for: 3, butt, 20cm


@dataclass(frozen=True, repr=False)
class RacketParameters(Schema):
    """The parameters are one racket with one string-bed: the whole content of one file.

    `specs` records what a shop printed and a regression filled in, where the parts were made of it,
    and `added` what was stuck on since: neither is a number of the model.
    """

    name: Text
    title: Text
    handle: Part
    head: Part
    throat_joint: ThroatJoint
    landmarks: Landmarks
    string_bed: StringBedParameters
    friction: FrictionParameters
    notes: tuple[Text, ...]
    specs: dict[Text, Spread] = field(default_factory=dict)  # of the whole racket, where made of it
    added: tuple[AddedMass, ...] = ()  # already in the parts' numbers
    frame: FrameDistribution = field(default_factory=FrameDistribution)

    def __post_init__(self) -> None:
        """The specs cannot be changed."""
        object.__setattr__(self, "specs", FrozenDict(self.specs))

    def __repr__(self) -> str:
        """Shows name and title."""
        return shown(self, f"{self.name}: {self.title}")

    def _repr_html_(self) -> str:
        """Shows a notebook every number with its unit, how it is known, and its source; folded."""
        rows = sourced_rows(self)
        inferred = sum(status == "inferred" for _, _, _, status, _ in rows)
        title = f"{self.title}: {len(rows)} entries, of which {inferred} are inferred"
        head = ("key", "value", "unit", "status", "source")
        return html_table(title, rows, head=head, folded=True)

    def bed_topology(self) -> BedTopology:
        """Tells which points the string-bed has, and which spring ends where."""
        return grid_topology(self.string_bed.columns, self.string_bed.rows)

    def frame_joints(self) -> tuple[FrameJoint, ...]:
        """Lists the joints of the frame, in their order from the butt."""
        return self._joints

    def frame_segments(self) -> tuple[FrameSegment, ...]:
        """Lists the rigid bodies of the frame from the butt: `handle` and `head` are among them."""
        return self._segments

    @functools.cached_property
    def _joints(self) -> tuple[FrameJoint, ...]:
        return joints_of(self)

    @functools.cached_property
    def _segments(self) -> tuple[FrameSegment, ...]:
        return segments_of(self)

    def point_in_head(self, number: int) -> tuple[float, float]:
        """Gives the rest position (x, y) (m) of a point in the head, from the throat joint."""
        bed = self.string_bed
        x, y = self.bed_topology().places[number - 1].tolist()
        return bed.gsc.value + x * bed.spacing.value, y * bed.spacing.value

    def point(self, number: int) -> tuple[float, float, float]:
        """Gives the rest position p_RoS_R (m) of a string-bed point in the undeformed racket."""
        x, y = self.point_in_head(number)
        return self.handle.length.value + x, y, 0.0

    def centre(self) -> tuple[float, float, float]:
        """Gives the geometric string-bed centre in the undeformed racket, from R's origin (m)."""
        return self.handle.length.value + self.string_bed.gsc.value, 0.0, 0.0

    def string_mass(self) -> float:
        """Gives the mass (kg) of one point of the string-bed."""
        return self.string_bed.mass.value / len(self.bed_topology().points)

    def friction_coefficients(self) -> list[float]:
        """Lists the coefficient at every point, in order."""
        mu, points = self.friction.coefficients.value, self.friction.points.value
        return [mu[int(points[str(i)][2:]) - 1] for i in self.bed_topology().points]


def load_racket(
    racket: str | os.PathLike[str] = "tour",
    tension: str | float = "low",
    *,
    joint_reading: str | None = None,
) -> RacketParameters:
    """Loads a shipped racket by name, or any racket from its YAML file.

    Args:
        racket: `tour`, `recreational`, or the path of a parameter file (ending in .yaml or .yml).
        tension: `low`, `high`, or a stringing tension in N (as text in any unit of one: `55lb`).
            A number takes T0 and the friction coefficients from the line through the two published
            tensions of that racket. A file has one string-bed and takes its own tension: leave it
            at `low`.
        joint_reading: overrides the file's reading of the joint labels.

    Raises:
        InputError: unknown name, unreadable file, or content that does not fit.

    """
    racket = name_or_path(racket, "racket")
    if racket.endswith((".yaml", ".yml")):
        if tension != "low":
            raise InputError("tension", tension, "no tension beside a parameter file (it has one)")
        parameters = read_racket(Path(racket))
    elif racket not in RACKETS:
        raise InputError("racket", racket, f"{', '.join(RACKETS)} or a path ending in .yaml")
    elif tension in TENSIONS:
        parameters = read_racket(data_directory() / f"{racket}_{tension}.yaml")
    else:
        parameters = _at_tension(racket, tension)
    if joint_reading is None:
        return parameters
    if joint_reading not in JOINT_READINGS:
        raise InputError("joint_reading", joint_reading, ", ".join(JOINT_READINGS))
    reading = Choice(joint_reading, "inferred", "chosen by the caller")
    joint = dataclasses.replace(parameters.throat_joint, reading=reading)
    return dataclasses.replace(parameters, throat_joint=joint)


def _at_tension(racket: str, tension: str | float) -> RacketParameters:
    allowed = f"{', '.join(TENSIONS)} or a stringing tension in N between 150 and 450"
    try:
        newton = measure("tension", tension, "N", bare="")
    except InputError:
        raise InputError("tension", tension, allowed) from None
    if not 150.0 <= newton <= 450.0:
        raise InputError("tension", tension, allowed)
    low, high = (read_racket(data_directory() / f"{racket}_{t}.yaml") for t in TENSIONS)
    low_bed, high_bed = low.string_bed, high.string_bed
    span = high_bed.stringing_tension.value - low_bed.stringing_tension.value
    share = (newton - low_bed.stringing_tension.value) / span

    def line(a: float, b: float) -> float:
        return a + share * (b - a)

    source = "line through the two published tensions of this racket"
    bed = dataclasses.replace(
        low_bed,
        stringing_tension=Quantity(newton, "N", "measured", "given by the caller"),
        initial_tension=Quantity(
            line(low_bed.initial_tension.value, high_bed.initial_tension.value),
            "N",
            "inferred",
            source,
        ),
    )
    pairs = zip(low.friction.coefficients.value, high.friction.coefficients.value, strict=True)
    mu = Quantities(tuple(line(a, b) for a, b in pairs), "1", "inferred", source)
    return dataclasses.replace(
        low,
        name=f"{racket}_{newton:g}N".replace(".", "p"),
        title=low.title.split(",")[0] + f", strung at {newton:g} N",
        string_bed=bed,
        friction=dataclasses.replace(low.friction, coefficients=mu),
    )


def read_racket(path: str | Path) -> RacketParameters:
    """Reads and checks one racket file; raises InputError."""
    return load_file(path, RacketParameters, _check_whole)


def check_racket(
    racket: RacketParameters,
    where: str = "racket",
    changed: Iterable[tuple[str, ...]] | None = None,
) -> None:
    """Checks units, signs, counts, assignments and geometry; raises InputError.

    Args:
        changed: paths of what alone may differ from what has been checked; None: all.

    """
    if changed is None:
        read(racket, RacketParameters, where)
    else:
        check_fields(racket, changed, where)
    _check_whole(racket, where)


def _check_whole(racket: RacketParameters, where: str) -> None:
    """What no single value shows."""
    check_name(racket.name, where)
    for part_name in ("handle", "head"):
        part: Part = getattr(racket, part_name)
        along, across, normal = part.moments()
        mean, half = 0.5 * (along + across), math.hypot(0.5 * (along - across), part.product())
        low, middle, high = sorted((mean - half, mean + half, normal))
        if part.com.value > part.length.value:
            raise InputError(
                f"{where}: {part_name}.com.value", part.com.value, f"at most {part.length.value}"
            )
        if high > (low + middle) * (1.0 + ROUNDING):
            raise InputError(
                f"{where}: {part_name}.moi_*",
                [low, middle, high],
                "no moment above the others' sum",
            )
    _check_geometry(racket, where)
    check_frame(racket, where)
    check_springs(racket.string_bed, racket.bed_topology(), where)
    check_friction(racket.friction, racket.bed_topology(), where)


def _check_geometry(racket: RacketParameters, where: str) -> None:
    bed = racket.string_bed
    for key in ("grip", "accelerometer"):
        place: Quantity = getattr(racket.landmarks, key)
        if place.value > racket.handle.length.value:
            raise InputError(
                f"{where}: landmarks.{key}.value",
                place.value,
                f"at most the handle's length, {racket.handle.length.value}",
            )
    a, b = bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
    x, y = bed.spacing.value * racket.bed_topology().places[0]
    if math.hypot(x / a, y / b) >= 1.0:  # ** would raise where a is tiny
        raise InputError(
            f"{where}: string_bed.rim_semi_axis_x.value",
            a,
            f"a rim that holds the corner points ({x} m from the centre along x, {y} m along y)",
        )
