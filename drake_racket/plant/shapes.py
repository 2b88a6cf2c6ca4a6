"""Gives rackets and balls shapes to be seen: rim tube, throat, handle, strings, felt and seam.

All of Drake's own shapes (capsules, boxes, spheres), so that no mesh is needed, and for the eye
alone: nothing here collides. Rim and string points are the model's; handle and throat are a sketch.
Whatever is drawn sits on a body that moves: the frame on handle and head, and on every string mass
its share of the strings that cross there, so that bending and the pocket under a ball are seen.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Box, Capsule, Shape, Sphere
from pydrake.math import RigidTransform, RotationMatrix

from drake_racket.parameters.frame import FrameSegment
from drake_racket.parameters.racket import RacketParameters
from drake_racket.parameters.segments import segment_at

if TYPE_CHECKING:
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import RigidBody

Points = NDArray[np.float64]

GRIP_HALF_WIDTH, GRIP_HALF_THICKNESS = 0.016, 0.013  # m
TUBE_RADIUS = 0.007  # m, of rim and throat
STRING_RADIUS, KNOT_RADIUS = 0.0012, 0.0032  # m; real strings have 0.65 mm: they would not be seen
SEAM_RADIUS = 0.0014  # m
RIM_PIECES, SEAM_PIECES = 40, 36

_JOINS = math.radians(140.0)  # where the throat's arms meet the rim
_SHAFT = 0.05  # m from the rim to the end of the handle's sketch

FRAME_COLOUR = (0.11, 0.16, 0.28, 1.0)
GRIP_COLOUR = (0.16, 0.14, 0.13, 1.0)
STRING_COLOUR = (0.92, 0.88, 0.72, 1.0)
FELT_COLOUR = (0.80, 0.88, 0.20, 1.0)
SEAM_COLOUR = (0.96, 0.97, 0.90, 1.0)


@dataclass(frozen=True)
class FrameLines:
    """The lines of a racket: each (k, 3) m in the axes of its body (handle: butt; head: throat)."""

    grip: Points
    handle_arms: tuple[Points, ...]
    head_arms: tuple[Points, ...]
    rim: Points


def frame_lines(
    handle_length: float, gsc: float, rim_x: float, rim_y: float, pieces: int = 96
) -> FrameLines:
    """Draws handle, rim, and the throat's arms, which the throat joint cuts in two.

    Args:
        handle_length: m from the butt to the throat joint.  gsc: the string-bed's centre from it.
        rim_x, rim_y: semi-axes of the rim (m).  pieces: straight ones of the rim.

    """
    angle = np.linspace(0.0, 2.0 * np.pi, pieces + 1)
    rim = np.column_stack([gsc + rim_x * np.cos(angle), rim_y * np.sin(angle), 0.0 * angle])
    shaft = handle_length + gsc - rim_x - _SHAFT
    width = GRIP_HALF_WIDTH
    corners = [(shaft, width), (0.0, width), (0.0, -width), (shaft, -width), (shaft, width)]
    grip = np.array([(x, y, 0.0) for x, y in corners])
    join = np.array([handle_length + gsc + rim_x * np.cos(_JOINS), rim_y * np.sin(_JOINS)])
    start = np.array([shaft, width])
    cut = float(np.clip((handle_length - shaft) / (join[0] - shaft), 0.0, 1.0))
    middle = start + cut * (join - start)
    handle_arms, head_arms = [], []
    for side in (1.0, -1.0):
        p, q, r = (np.array([x, side * y, 0.0]) for x, y in (start, middle, join))
        handle_arms.append(np.array([p, q]))
        head_arms.append(np.array([q, r]) - [handle_length, 0.0, 0.0])
    return FrameLines(grip, tuple(handle_arms), tuple(head_arms), rim)


def seam(radius: float, pieces: int = SEAM_PIECES) -> Points:
    """Gives the seam of a tennis ball as a closed line (pieces + 1, 3) on its sphere.

    x = a cos t + b cos 3t, y = a sin t - b sin 3t, z = 2 sqrt(a b) sin 2t with a + b = radius lies
    on the sphere, since |p|^2 = (a + b)^2; b = a/3 has a tennis ball's look.
    """
    a, b = 0.75 * radius, 0.25 * radius
    t = np.linspace(0.0, 2.0 * np.pi, pieces + 1)
    return np.column_stack(
        [
            a * np.cos(t) + b * np.cos(3.0 * t),
            a * np.sin(t) - b * np.sin(3.0 * t),
            2.0 * math.sqrt(a * b) * np.sin(2.0 * t),
        ]
    )


def string_pieces(parameters: RacketParameters, number: int) -> list[Points]:
    """Gives the pieces of string that a string mass carries, (2, 3) m in its own axes.

    Half-way to the next mass; to the rim where there is none.
    """
    bed, topology = parameters.string_bed, parameters.bed_topology()
    x, y = bed.spacing.value * topology.places[number - 1]
    a, b = bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
    pieces = []
    for i, direction in enumerate(topology.directions):
        ends = int(topology.first[i]) + 1, int(topology.second[i]) + 1
        if number not in ends:
            continue
        along = np.array([*direction, 0.0]) * (1.0 if ends[0] == number else -1.0)
        length = 0.5 * bed.spacing.value
        if ends[1] == 0:
            across, half, reach = (y, b, a) if direction[0] else (x, a, b)
            length = reach * math.sqrt(1.0 - (across / half) ** 2)
            length -= abs(x if direction[0] else y)
        pieces.append(np.array([[0.0, 0.0, 0.0], length * along]))
    return pieces


def show_racket(
    plant: MultibodyPlant,
    segments: Sequence[RigidBody],
    strings: tuple[RigidBody, ...],
    parameters: RacketParameters,
) -> None:
    """Registers a racket's shapes, if the plant has a SceneGraph; without one it does nothing.

    Of two segments arms and rim are those of handle and head; of more, each piece sits on the
    segment that holds its middle.
    """
    if not plant.geometry_source_is_registered():
        return
    bed, throat = parameters.string_bed, parameters.handle.length.value
    lines = frame_lines(
        throat, bed.gsc.value, bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value, RIM_PIECES
    )
    bodies = list(zip(segments, parameters.frame_segments(), strict=True))
    _grip(plant, bodies, float(lines.grip[:, 0].max()))
    named = [(f"arm_{i}", arm, 0.0) for i, arm in enumerate(lines.handle_arms)]
    named += [(f"arm_{i}", arm, throat) for i, arm in enumerate(lines.head_arms)]
    for name, line, start in [*named, ("rim", lines.rim, throat)]:
        points = np.add(line, [start, 0.0, 0.0])
        for i in range(len(points) - 1):
            middle = start if len(bodies) == 2 else float(points[i : i + 2, 0].mean())
            body, own = bodies[segment_at([segment for _, segment in bodies], middle)]
            ends = points[i : i + 2] - [own.origin, 0.0, 0.0]
            _tube(plant, body, name, ends, TUBE_RADIUS, FRAME_COLOUR, first=i)
    for number, body in enumerate(strings, 1):
        _register(plant, body, "knot", Sphere(KNOT_RADIUS), RigidTransform(), STRING_COLOUR)
        for i, piece in enumerate(string_pieces(parameters, number)):
            _tube(plant, body, f"string_{i}", piece, STRING_RADIUS, STRING_COLOUR)


def _grip(
    plant: MultibodyPlant, bodies: Sequence[tuple[RigidBody, FrameSegment]], shaft: float
) -> None:
    """The handle's sketch, on as many segments as it reaches over."""
    for body, own in bodies:
        low, high = own.start, min(own.end, shaft) if len(bodies) > 2 else shaft
        if high > low:
            box = Box(high - low, 2.0 * GRIP_HALF_WIDTH, 2.0 * GRIP_HALF_THICKNESS)
            pose = RigidTransform([0.5 * (low + high) - own.origin, 0.0, 0.0])
            _register(plant, body, "grip", box, pose, GRIP_COLOUR)


def show_ball(plant: MultibodyPlant, body: RigidBody, radius: float) -> None:
    """Registers a ball's shapes, if the plant has a SceneGraph.

    The model's ball is a point: its centre meets the strings, so that the sphere about it is half
    through them by then. (The animation, which knows what the ball will hit, lays it on top.)
    """
    if not plant.geometry_source_is_registered():
        return
    _register(plant, body, "felt", Sphere(radius), RigidTransform(), FELT_COLOUR)
    _tube(plant, body, "seam", seam(radius), SEAM_RADIUS, SEAM_COLOUR)


def _tube(
    plant: MultibodyPlant,
    body: RigidBody,
    name: str,
    line: Points,
    radius: float,
    colour: Any,
    *,
    first: int = 0,
) -> None:
    """A tube of capsules along a line, numbered from `first`."""
    for i, (start, end) in enumerate(itertools.pairwise(line), first):
        step = end - start
        length = float(np.linalg.norm(step))
        along_z = RotationMatrix.MakeFromOneVector(step / length, 2)
        pose = RigidTransform(along_z, 0.5 * (start + end))
        _register(plant, body, f"{name}_{i}", Capsule(radius, length), pose, colour)


def _register(
    plant: MultibodyPlant,
    body: RigidBody,
    name: str,
    shape: Shape,
    pose: RigidTransform,
    colour: Any,
) -> None:
    plant.RegisterVisualGeometry(body, pose, shape, f"{body.name()}_{name}", np.array(colour))
