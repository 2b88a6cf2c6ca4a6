"""Computes mode shapes along the racket's axis: displacements, nodes and antinodes.

Rigid segments on hinges move along the axis in straight pieces. So what the model can give:

- *exactly*: of two bodies each has at most one node, which inertia alone decides for a free racket
  (momentum balance), and the antinode between two nodes is the hinge, in both planes, by
  construction: the model holds the antinodes' mean position, not the up to 25 mm between them; of
  more segments the nodes are all zeros of the straight pieces, and the antinode the vertex of the
  parabola through the middles of the three segments that move most between the outer nodes;
- *by regression*, as the source evaluated its measurements (Glynn et al. 2011, Methods): one
  quadratic, by least squares, through the extreme displacements of points along the whole axis;
  nodes where it is zero, antinode where it is largest between the nodes (its vertex). The two
  extremes of an oscillation are each other's negative here and give the same places. Where the
  source's points lay is not printed: evenly spaced from butt to tip is inferred.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from pydrake.multibody.tree import JacobianWrtVariable, RigidBody

from drake_racket.io.errors import InputError
from drake_racket.parameters.racket import RacketParameters
from drake_racket.rigs.modes.modal_analysis import ModalSystem, Modes, modal_system, solve_modes

PLANES = ("in_plane", "out_of_plane")
"""A plane of bending is that of displacement along y, or along z."""

SAMPLES = 21
"""Points along the axis that the regression of a mode's shape takes (inferred)."""

_STILL = 1e-6  # displacements below this share of a mode's largest are round-off, not motion


def check_samples(samples: int) -> None:
    """Checks that a quadratic has more than three points; raises InputError."""
    if isinstance(samples, bool) or not isinstance(samples, int) or not 4 <= samples <= 10_000:
        raise InputError("samples", samples, "4 to 10000 points along the axis")


@dataclass(frozen=True)
class Shapes:
    """Holds the normalised displacements of n modes: the largest of all that are listed here is +1.

    Those are the axis's (along y and z), the rim's sides (along z) and the strings' (along the
    head's z, from the head). Units: per unit of the largest displacement (m/m; roll in rad/m).

    Attributes:
        corners: (n, 2, k + 1) along y and z at `places`, the ends of the k segments (of two: butt,
            throat and tip); straight lines join them.
        rolls: (n,) rotation about x, of the head.
        strings: (n, points); empty (n, 0) if not strung.

    """

    corners: NDArray[np.float64]
    rolls: NDArray[np.float64]
    strings: NDArray[np.float64]
    places: tuple[float, ...]  # m from the butt

    @property
    def tip(self) -> float:
        """Gives the place of the tip, m from the butt."""
        return self.places[-1]

    def along_axis(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gives the displacement (n, 2, len(x)) along y and z at `x` (m from the butt)."""
        lines = [[np.interp(x, self.places, corners) for corners in mode] for mode in self.corners]
        return np.array(lines).reshape(len(self.corners), 2, len(x))

    def plane(self, mode: int) -> str | None:
        """Gives the plane in which the axis of a mode moves; None if it does not (roll, say)."""
        size = np.max(np.abs(self.corners[mode]), axis=1)
        return PLANES[int(np.argmax(size))] if np.max(size) > _STILL else None

    def frame_motion(self) -> NDArray[np.float64]:
        """Gives (n,) largest displacement of the frame over that of the strings."""
        frame = np.max(np.abs(self.corners), axis=(1, 2))
        motion: NDArray[np.float64] = frame / np.max(np.abs(self.strings), axis=1)
        return motion


def mode_shapes(modes: Modes) -> Shapes:
    """Gives the displacements of all modes, from the plant's Jacobians."""
    system = modes.system
    racket, parameters = system.racket, system.racket.parameters
    bed = parameters.string_bed
    rim = np.array([[bed.gsc.value] * 2, [bed.rim_semi_axis_y.value] * 2, [0.0, 0.0]])
    rim[1, 1] *= -1.0
    axis = _axis(system, modes.shapes)
    sides = _displacements(system, racket.head, rim, modes.shapes)
    strings = modes.shapes[[joint.velocity_start() for joint in racket.string_joints], :].T
    corners = axis.transpose(2, 1, 0)[:, 1:, :]
    rolls = (sides[0, 2] - sides[1, 2]) / (2.0 * bed.rim_semi_axis_y.value)
    everything = np.concatenate([corners.reshape(len(corners), -1), sides[:, 2].T, strings], axis=1)
    scale = _largest(everything)
    return Shapes(
        corners=corners / scale[:, np.newaxis, np.newaxis],
        rolls=rolls / scale,
        strings=strings / scale[:, np.newaxis],
        places=segment_ends(parameters),
    )


def segment_ends(parameters: RacketParameters) -> tuple[float, ...]:
    """Gives the ends of a frame's segments, m from the butt."""
    segments = parameters.frame_segments()
    return (0.0, *(segment.end for segment in segments))


def _axis(system: ModalSystem, shapes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Displacement (k + 1, 3, n) in R of the axis at the ends of the k segments, in all modes."""
    segments = system.racket.parameters.frame_segments()
    moved = [_displacements(system, system.racket.handle, np.zeros((3, 1)), shapes)]
    for i, (body, segment) in enumerate(zip(system.racket.segments, segments, strict=True)):
        places = [segment.start, segment.end] if i == 1 else [segment.end]
        if i == 0:
            continue
        points = np.array([[x - segment.origin for x in places], [0.0] * len(places)])
        points = np.concatenate([points, np.zeros((1, len(places)))])
        moved.append(_displacements(system, body, points, shapes))
    return np.concatenate(moved)


def _displacements(
    system: ModalSystem,
    body: RigidBody,
    points: NDArray[np.float64],
    shapes: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Displacement (points, 3, n) in R of points (3, points) of a body, in all modes."""
    plant = system.plant
    jacobian = plant.CalcJacobianTranslationalVelocity(
        system.plant_context(),
        JacobianWrtVariable.kV,
        body.body_frame(),
        points,
        plant.world_frame(),
        plant.world_frame(),
    )
    moved: NDArray[np.float64] = (jacobian @ shapes).reshape(points.shape[1], 3, -1)
    return moved


def _largest(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The entry of largest size in each row, with its sign; 1 for a motion along x alone.

    Of entries of equal size (within 0.1 %) the first counts, so that round-off chooses no sign.
    """
    sizes = np.max(np.abs(values), axis=1, initial=0.0)
    first = np.argmax(np.abs(values) >= 0.999 * sizes[:, np.newaxis], axis=1)
    found = values[np.arange(len(values)), first]
    result: NDArray[np.float64] = np.where(sizes > _STILL, found, 1.0)
    return result


@dataclass(frozen=True)
class ModeLandmarks:
    """Nodes from the butt on, and the antinode between them, m from the butt; nan for none.

    Of two segments the nodes are those of handle and head.
    """

    nodes: tuple[float, ...]
    antinode: float


NO_LANDMARKS = ModeLandmarks((np.nan, np.nan), np.nan)


def exact_landmarks(corners: NDArray[np.float64], places: Sequence[float]) -> ModeLandmarks:
    """Zeros of the straight pieces, and the antinode if it lies between two nodes.

    A body that does not move, or has no zero within its length, has no node.

    Args:
        corners: (k + 1,) displacement at `places`, the ends of the segments, m from the butt.

    """
    least = 1e-9 * np.max(np.abs(corners))
    nodes = []
    for i, (start, end) in enumerate(itertools.pairwise(corners)):
        inside = start * end < 0.0 and min(abs(start), abs(end)) > least
        share = start / (start - end) if inside else np.nan
        nodes.append(float(places[i] + (places[i + 1] - places[i]) * share))
    if len(nodes) == 2:
        return ModeLandmarks((nodes[0], nodes[1]), np.nan if np.isnan(nodes).any() else places[1])
    found = [node for node in nodes if not np.isnan(node)]
    antinode = _antinode(corners, places, found) if len(found) > 1 else np.nan
    return ModeLandmarks(tuple(found), antinode)


def _antinode(
    corners: NDArray[np.float64], places: Sequence[float], nodes: Sequence[float]
) -> float:
    """The vertex of a parabola through the middles of segments about the largest displacement.

    Between the first two nodes, of the middles and their neighbours.
    """
    middle = 0.5 * (np.array(places[:-1]) + np.array(places[1:]))
    moved = 0.5 * (corners[:-1] + corners[1:])
    inside = (middle > nodes[0]) & (middle < nodes[1])
    if not inside.any():
        return 0.5 * (nodes[0] + nodes[1])
    top = int(np.argmax(np.where(inside, np.abs(moved), -1.0)))
    top = min(max(top, 1), len(middle) - 2)
    near = slice(top - 1, top + 2)
    curve, slope, _ = np.polyfit(middle[near] - middle[top], moved[near], 2)
    return float(np.clip(middle[top] - 0.5 * slope / curve, nodes[0], nodes[1]))


def quadratic_fit(x: NDArray[np.float64], displacement: NDArray[np.float64]) -> Polynomial:
    """Gives the quadratic of least squares through displacements at `x` (m)."""
    fit: Polynomial = Polynomial.fit(x, displacement, 2)
    return fit


def regression_landmarks(fit: Polynomial, tip: float) -> ModeLandmarks:
    """Zeros and vertex of the fitted quadratic; none unless both zeros are on the racket."""
    zeros = fit.roots()
    if len(zeros) < 2 or np.any(zeros.imag != 0.0):
        return NO_LANDMARKS
    first, second = sorted(float(zero.real) for zero in zeros)
    if first < 0.0 or second > tip:
        return NO_LANDMARKS
    return ModeLandmarks((first, second), 0.5 * (first + second))


def sample_points(parameters: RacketParameters, samples: int = SAMPLES) -> NDArray[np.float64]:
    """Gives places (m from the butt) whose displacement the regression takes: even, butt to tip."""
    check_samples(samples)
    length = parameters.handle.length.value + parameters.head.length.value
    return np.linspace(0.0, length, samples)


def head_node(parameters: RacketParameters) -> float:
    """Finds the exact out-of-plane node on the head of the free, strung racket, m from the butt.

    A ball that strikes there excites bending least.
    """
    modes = solve_modes(modal_system(parameters))
    shapes = mode_shapes(modes)
    corners = shapes.corners[modes.bending("out_of_plane"), PLANES.index("out_of_plane")]
    return exact_landmarks(corners, shapes.places).nodes[-1]
