"""A stroke says what a user asks of a racket at impact: its place, its face, and its motion.

World frame W: z up, x forward (towards the net), y to the left. The racket's frame C is `gsc`,
the centre of the string-bed: x to the tip, z normal to the strings on the ball's side. The face is
named by three angles: how far its normal points below the horizontal (closed), the normal's heading
(azimuth, from x towards y), and how far the racket's long axis rises above the horizontal (tip
elevation).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.numbers import number_between, plain_numbers
from drake_racket.io.schema import Flag, Number, OneOf, Schema, Text, Three, read, shown_changes

Vector = NDArray[np.float64]

TIP_SIDES = ("left", "right")
Free = tuple[float | None, ...]
_STEEPEST = 89.0  # degrees; at 90 the heading of the face, or of the racket, is not defined


def face_rotation(closed: float, azimuth: float, tip_elevation: float, tip_side: str) -> Vector:
    """Gives R_WC (3, 3) of a face, angles in rad.

    The face's horizontal axis h points to the left as one looks along the normal n, and its upward
    axis is u = n x h; the long axis is +-cos(r) h + sin(r) u with sin(r) = sin(tip_elevation) /
    cos(closed), plus for `tip_side` left and minus for right. Needs |tip_elevation| + |closed| of
    at most a right angle.
    """
    normal = np.array(
        [
            math.cos(closed) * math.cos(azimuth),
            math.cos(closed) * math.sin(azimuth),
            -math.sin(closed),
        ]
    )
    left = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    up = np.cross(normal, left)
    sine = float(np.clip(math.sin(tip_elevation) / math.cos(closed), -1.0, 1.0))
    side = 1.0 if tip_side == "left" else -1.0
    axis = side * math.sqrt(1.0 - sine * sine) * left + sine * up
    return np.column_stack([axis, np.cross(normal, axis), normal])


def face_angles(R_WC: Vector) -> Vector:
    """Gives closed, azimuth and tip elevation (rad) of a face: the inverse of `face_rotation`."""
    axis, normal = R_WC[:, 0], R_WC[:, 2]
    return np.array(
        [
            math.atan2(-normal[2], math.hypot(normal[0], normal[1])),
            math.atan2(normal[1], normal[0]),
            math.atan2(axis[2], math.hypot(axis[0], axis[1])),
        ]
    )


@dataclass(frozen=True)
class PoseTarget:
    """Says where C should be; NaN is free.

    Attributes:
        position: (3,) p_WoCo_W (m).
        angles: (3,) closed, azimuth, tip elevation (rad).
        tip_side: `left` or `right`; counts where all three angles are given, since two faces share
            them. With fewer the guess decides.

    """

    position: Vector
    angles: Vector
    tip_side: str = "right"

    def rotation(self) -> Vector | None:
        """Gives R_WC where all angles are given, else None."""
        if np.isnan(self.angles).any():
            return None
        closed, azimuth, tip_elevation = self.angles
        return face_rotation(closed, azimuth, tip_elevation, self.tip_side)


@dataclass(frozen=True, repr=False)
class Stroke(Schema):
    """A stroke is what a user asks of the racket at impact. None is free; angles in degrees.

    Attributes:
        position: of the string-bed's centre in W (m), each component or None.
        face_closed_deg: how far the normal of the face points below the horizontal; an open face
            is negative.
        face_azimuth_deg: heading of the normal, from x (0) towards y.
        tip_elevation_deg: of the racket's long axis above the horizontal; with a face closed (or
            open) by c it is at most 90 - c.
        tip_side: where the tip is as one looks along the normal of the face, `left` or `right` (a
            right-hander's forehand). It counts if all three angles are given; else the guess
            decides.
        speed: of the string-bed's centre (m/s); None leaves the linear velocity free.
        velocity_elevation_deg, velocity_azimuth_deg: its direction, above the horizontal and from
            x towards y.
        angular_velocity: of the racket, in W (rad/s), each component or None.
        rate_limits: the joints' rates stay within their limits, if they have any; false ignores
            them.
        guess_deg: joint name -> degrees (metres at a prismatic joint); a coordinate of a joint with
            several is named as in `StrokeState.names`. Picks one of the postures that meet the
            rest; joints that it leaves out start at the plant's default.

    """

    position: Annotated[Free, Three("m", 10.0, free=True)] = (None, None, None)
    face_closed_deg: Annotated[float, Number("degrees", -_STEEPEST, _STEEPEST)] | None = None
    face_azimuth_deg: Annotated[float, Number("degrees", -360.0, 360.0)] | None = None
    tip_elevation_deg: Annotated[float, Number("degrees", -90.0, 90.0)] | None = None
    tip_side: Annotated[str, OneOf(*TIP_SIDES)] = "right"
    speed: Annotated[float, Number("m/s", 0.0, 100.0)] | None = None
    velocity_elevation_deg: Annotated[float, Number("degrees", -90.0, 90.0)] = 0.0
    velocity_azimuth_deg: Annotated[float, Number("degrees", -360.0, 360.0)] = 0.0
    angular_velocity: Annotated[Free, Three("rad/s", 1000.0, free=True)] = (None, None, None)
    rate_limits: Flag = True
    guess_deg: dict[Text, Annotated[float, Number("degrees", -1e4, 1e4)]] = field(
        default_factory=dict
    )

    def __post_init__(self) -> None:
        """Numbers become Python floats."""
        plain_numbers(self)

    def __repr__(self) -> str:
        """Shows what differs from the defaults."""
        return shown_changes(self)

    def pose_target(self) -> PoseTarget:
        """Gives the wanted position (m) and angles (rad); NaN is free."""
        angles = (self.face_closed_deg, self.face_azimuth_deg, self.tip_elevation_deg)
        return PoseTarget(_nan(self.position), np.radians(_nan(angles)), self.tip_side)

    def velocity_target(self) -> Vector:
        """Gives the wanted V_WC in W: angular (rad/s), then linear (m/s) velocity; NaN is free."""
        elevation = math.radians(self.velocity_elevation_deg)
        azimuth = math.radians(self.velocity_azimuth_deg)
        flat = math.cos(elevation)
        direction = [flat * math.cos(azimuth), flat * math.sin(azimuth), math.sin(elevation)]
        speed = math.nan if self.speed is None else self.speed
        return np.concatenate([_nan(self.angular_velocity), speed * np.array(direction)])


def _nan(values: Free) -> Vector:
    return np.array([math.nan if x is None else x for x in values], dtype=float)


def check_stroke(stroke: Stroke, where: str = "stroke") -> None:
    """Checks every value but the names in `guess_deg`, which need a limb.

    Raises:
        InputError: naming the key, the value and what is allowed.

    """
    stroke = read(stroke, Stroke, where)
    check_tip(stroke, where)


def check_tip(stroke: Stroke, where: str) -> None:
    """Checks that the racket can rise as far as is asked with this face; raises InputError."""
    if stroke.tip_elevation_deg is None:
        return
    whole = stroke.face_closed_deg is not None and stroke.face_azimuth_deg is not None
    most = 90.0 - abs(stroke.face_closed_deg or 0.0)
    most = most if whole else min(most, _STEEPEST)
    number_between(f"{where}: tip_elevation_deg", stroke.tip_elevation_deg, -most, most)
