"""Computes what an animation shows, frame by frame, from a history alone.

What is exaggerated, and how the ball still touches the strings:

- `magnify` multiplies the two angles of the throat joint. The handle stays where it is and the head
  is drawn bent (with a clamped head the handle is). The ball goes with the drawn head while it
  touches the strings, and returns to its own path within the next 0.1 m.
- `magnify_strings` multiplies the deflections of the string masses, and the depth of the ball's
  lowest point under the string plane with them. A ball that has left is shifted by what it was at
  its highest point in contact, so that its path has no jump.

The model's ball is a point that meets the strings. It is drawn as a sphere that lies on that point;
where the point is below the strings by the compression x, the sphere is flattened by x, at constant
volume. It has no spin. A ball of contact surface is where its centre is, and turns.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from drake_racket.animation.settings import AnimationSettings
from drake_racket.io.errors import InputError
from drake_racket.laws.bed import BedTopology, named_topology
from drake_racket.results.log_checks import check_history

if TYPE_CHECKING:
    import xarray

_CARRIED = 0.1  # m above the strings, where the ball is back on its own path
_LONGEST = 10.0  # m, of the lengths of a racket
_FLATTEST = 0.8  # of the ball's diameter, the most that is drawn of a compression
_NEEDED = (
    "ball_position",
    "in_contact",
    "contact_point",
    "normal_force",
    "string_deflection",
    "in_plane_angle",
    "out_of_plane_angle",
    "butt_position",
    "handle_quaternion",
)


@dataclass(frozen=True)
class Geometry:
    """Holds lengths (m) of racket and ball, landmarks that a limb's segments join, the bed."""

    handle_length: float
    head_length: float
    gsc: float
    spacing: float
    rim_semi_axis_x: float
    rim_semi_axis_y: float
    ball_radius: float
    segments: tuple[tuple[str, str], ...]
    bed: BedTopology


@dataclass(frozen=True)
class Pose:
    """Holds a body over n frames: places (n, 3) (m) and n rotations, in the world."""

    place: NDArray[np.float64]
    rotation: Rotation

    def points(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gives the points (k, 3) of the body in the world, (n, k, 3)."""
        turned = np.einsum("nij,kj->nki", self.rotation.as_matrix(), points)
        return np.asarray(self.place[:, None, :] + turned)


@dataclass(frozen=True)
class Scene:
    """Holds n frames of an animation, as drawn: exaggeration included. SI units, in the world.

    Attributes:
        fps: of the animation.  time: (n,) s from touch.
        handle: with its origin at the butt.  head: at the throat joint.
        strings: (n, points) drawn deflections of the masses along the head's z.
        ball: with its z along the normal of the strings.  ball_axes: (n, 3) semi-axes.
        ball_turn: n rotations from there to its seam; None of a ball that does not spin.
        landmarks: name -> (n, 3).
        force: (n,) normal force (N).  bending: (n,) true angle out of plane (rad).
        in_contact: (n,) bool.
        title: of the history.  scenario: what was simulated, as in the history.

    """

    geometry: Geometry
    settings: AnimationSettings
    fps: float
    time: NDArray[np.float64]
    handle: Pose
    head: Pose
    strings: NDArray[np.float64]
    ball: Pose
    ball_axes: NDArray[np.float64]
    ball_turn: Rotation | None
    landmarks: dict[str, NDArray[np.float64]]
    force: NDArray[np.float64]
    bending: NDArray[np.float64]
    in_contact: NDArray[np.bool_]
    title: str
    scenario: dict[str, Any]


def read_geometry(history: xarray.Dataset) -> Geometry:
    """Gives the lengths that a history carries.

    Raises:
        InputError: it is not a history, lacks something, or has numbers that are not finite.

    """
    missing = [name for name in ("time", "spring", *_NEEDED) if name not in history.variables]
    missing += [name for name in ("geometry", "scenario", "title") if name not in history.attrs]
    if missing:
        allowed = f"a history of this version of drake-racket impact (this lacks {missing[0]})"
        raise InputError("LOG", str(history.encoding.get("source", "dataset")), allowed)
    bed = _bed(history)
    try:
        values = json.loads(history.attrs["geometry"])
        segments = tuple((str(a), str(b)) for a, b in values.pop("segments"))
        lengths = {k: float(v) for k, v in values.items()}
        geometry = Geometry(**lengths, segments=segments, bed=bed)
    except (ValueError, TypeError, KeyError, AttributeError):
        allowed = "the lengths that drake-racket impact writes"
        raise InputError("LOG: geometry", history.attrs["geometry"], allowed) from None
    for key, length in values.items():
        if not 0.0 < float(length) <= _LONGEST:
            raise InputError(f"LOG: geometry, {key}", length, f"above 0, up to {_LONGEST:g} m")
    known = history["landmark"].to_numpy().tolist() if "landmark" in history.coords else []
    for name in sorted({name for pair in segments for name in pair} - set(known)):
        raise InputError("LOG: geometry, segments", name, ", ".join(known) or "no segments")
    check_history(history, "LOG")
    return geometry


def _bed(history: xarray.Dataset) -> BedTopology:
    springs = history["spring"].to_numpy().astype(str).tolist()
    bed = named_topology(springs)
    if bed is None or history["string_deflection"].shape[1:] != (len(bed.points),):
        allowed = "the springs of a bed, and the deflections of its points"
        raise InputError("LOG: spring", f"{len(springs)} names", allowed)
    return bed


def make_scene(
    history: xarray.Dataset,
    geometry: Geometry,
    settings: AnimationSettings,
    fps: float,
    frames: int,
) -> Scene:
    """Samples a history, as `read_geometry` has checked it, evenly and exaggerates it."""
    log = _Log(history, 1.0 / (fps * settings.slowdown), frames)
    scenario = json.loads(history.attrs["scenario"])
    angles = np.column_stack([log.values("in_plane_angle"), log.values("out_of_plane_angle")])
    true_handle = Pose(log.values("butt_position"), log.rotation())
    true_head = _head(true_handle, angles, geometry)
    drawn = settings.magnify * angles
    if scenario["support"] == "clamped_head":
        head, handle = true_head, _handle(true_head, drawn, geometry)
    else:
        handle, head = true_handle, _head(true_handle, drawn, geometry)
    deflection = log.values("string_deflection")
    ball, axes = _ball(log, deflection, true_head, head, geometry, settings)
    turn = ball.rotation.inv() * log.rotation("ball_quaternion") if log.spins else None
    places = [log.values(f"landmark_{a}") for a in "xyz" if f"landmark_{a}" in history]
    names = history["landmark"].to_numpy().tolist() if places else []
    landmarks = {str(n): np.stack([p[:, i] for p in places], 1) for i, n in enumerate(names)}
    return Scene(
        geometry=geometry,
        settings=settings,
        fps=fps,
        time=log.time,
        handle=handle,
        head=head,
        strings=settings.magnify_strings * deflection,
        ball=ball,
        ball_axes=axes,
        ball_turn=turn,
        landmarks=landmarks,
        force=log.values("normal_force"),
        bending=angles[:, 1],
        in_contact=log.nearest("in_contact") > 0.5,
        title=str(history.attrs["title"]),
        scenario=scenario,
    )


class _Log:
    """A history at even times; its own samples are much denser than frames of slow motion."""

    def __init__(self, history: xarray.Dataset, step: float, frames: int) -> None:
        time = history["time"].to_numpy()
        # of samples at one time the last is the state after the event
        self.history = history = history.isel(time=np.append(np.diff(time) > 0.0, True))
        self._own = history["time"].to_numpy()
        self.spins = "ball_quaternion" in history
        # a frame may lie beyond the last sample by rounding
        self.time = np.minimum(self._own[0] + step * np.arange(frames), self._own[-1])

    def values(self, name: str) -> NDArray[np.float64]:
        """Interpolated linearly, (n,) or (n, k)."""
        values = self.history[name].to_numpy()
        columns = [np.interp(self.time, self._own, c) for c in np.atleast_2d(values.T)]
        return columns[0] if values.ndim == 1 else np.column_stack(columns)

    def nearest(self, name: str) -> NDArray[np.float64]:
        """Of the last sample at or before each time, (n,)."""
        at = np.searchsorted(self._own, self.time, side="right") - 1
        return np.asarray(self.history[name].to_numpy()[at])

    def rotation(self, name: str = "handle_quaternion") -> Rotation:
        """Of the handle, or of the ball."""
        w, x, y, z = self.history[name].to_numpy().T
        return Slerp(self._own, Rotation.from_quat(np.column_stack([x, y, z, w])))(self.time)


def _bend(angles: NDArray[np.float64]) -> Rotation:
    """The throat joint: about z by the first angle, then about the new y by the second."""
    return Rotation.from_euler("ZY", angles)


def _head(handle: Pose, angles: NDArray[np.float64], geometry: Geometry) -> Pose:
    throat = handle.rotation.apply([geometry.handle_length, 0.0, 0.0])
    return Pose(handle.place + throat, handle.rotation * _bend(angles))


def _handle(head: Pose, angles: NDArray[np.float64], geometry: Geometry) -> Pose:
    rotation = head.rotation * _bend(angles).inv()
    return Pose(head.place - rotation.apply([geometry.handle_length, 0.0, 0.0]), rotation)


def _ball(
    log: _Log,
    deflection: NDArray[np.float64],
    true_head: Pose,
    head: Pose,
    geometry: Geometry,
    settings: AnimationSettings,
) -> tuple[Pose, NDArray[np.float64]]:
    """Pose and semi-axes of the drawn ball; see the module's docstring."""
    inside = log.nearest("in_contact") > 0.5
    # before touch and after release the ball keeps the strings' direction of that time
    frame = np.arange(len(inside))
    if inside.any():
        frame = np.clip(frame, *np.flatnonzero(inside)[[0, -1]])
    radius, position = geometry.ball_radius, log.values("ball_position")
    if log.spins:  # its centre is logged: from there to its lowest point
        position = position - true_head.rotation[frame].apply([0.0, 0.0, radius])
    place = true_head.rotation.inv().apply(position - true_head.place)
    point = log.nearest("contact_point").astype(int)
    string = deflection[np.arange(len(point)), point - 1]
    pressed = log.values("compression") if log.spins else string - place[:, 2]
    x = np.clip(pressed, 0.0, 2.0 * _FLATTEST * radius) if inside.any() else 0.0
    height = place[:, 2] + x  # of the ball's lowest point over the string plane
    highest = max(0.0, float(height[inside].max())) if inside.any() else 0.0
    shift = (settings.magnify_strings - 1.0) * np.minimum(height, highest)
    lowest = np.column_stack([place[:, :2], height + shift])
    free, carried = (pose.place + pose.rotation.apply(lowest) for pose in (true_head, head))
    away = np.clip((height - highest) / _CARRIED, 0.0, 1.0)
    weight = 1.0 - away * away * (3.0 - 2.0 * away)
    rotation = head.rotation[frame]
    centre = free + weight[:, None] * (carried - free)
    half = np.broadcast_to(radius - 0.5 * x, height.shape)
    centre = centre + rotation.apply([0.0, 0.0, 1.0]) * half[:, None]
    wide = radius * np.sqrt(radius / half)
    return Pose(centre, rotation), np.column_stack([wide, wide, half])
