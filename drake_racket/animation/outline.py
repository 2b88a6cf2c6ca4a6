"""Gives the racket's shape: lines of its two rigid bodies as polylines, and tubes.

Rim and string points are the model's; handle and throat are a sketch (`plant.shapes`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_racket.animation.scene import Geometry
from drake_racket.laws.bed import rest_lengths
from drake_racket.plant.shapes import FrameLines, frame_lines


def racket_outline(geometry: Geometry) -> FrameLines:
    """Draws handle, rim, and the throat's arms, which the throat joint cuts in two."""
    g = geometry
    return frame_lines(g.handle_length, g.gsc, g.rim_semi_axis_x, g.rim_semi_axis_y)


def string_points(geometry: Geometry) -> NDArray[np.float64]:
    """Gives the places of the points at rest in the head, (n, 3) m."""
    s = geometry.spacing
    return np.array([(geometry.gsc + x * s, y * s, 0.0) for x, y in geometry.bed.places])


def spring_ends(geometry: Geometry) -> list[tuple[int, int, NDArray[np.float64]]]:
    """Gives each spring's first point, its second or 0 for the rim, and the vector between.

    Points are numbered from 1; the vector (m) is at rest, in the head.
    """
    bed = geometry.bed
    lengths = rest_lengths(
        bed, geometry.spacing, geometry.rim_semi_axis_x, geometry.rim_semi_axis_y
    )
    vectors = np.column_stack([lengths[:, None] * bed.directions, np.zeros(len(lengths))])
    first, second = (1 + bed.ends).tolist()
    return list(zip(first, second, vectors, strict=True))


def tube(
    line: NDArray[np.float64], half_width: float, half_thickness: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Gives a tube around a line in the plane z = 0, with elliptic sections and closed ends.

    Returns:
        Vertices (3, n) m and triangles (3, m), outward.

    """
    steps = np.diff(line, axis=0)
    closed = np.allclose(line[0], line[-1])
    before = np.vstack([steps[-1:] if closed else steps[:1], steps])
    after = np.vstack([steps, steps[:1] if closed else steps[-1:]])
    along = before / np.linalg.norm(before, axis=1)[:, None]
    along = along + after / np.linalg.norm(after, axis=1)[:, None]
    along /= np.linalg.norm(along, axis=1)[:, None]
    sideways = np.column_stack([-along[:, 1], along[:, 0], 0.0 * along[:, 0]])
    sides = 12
    turn = 2.0 * np.pi * np.arange(sides) / sides
    section = half_width * np.cos(turn)[None, :, None] * sideways[:, None, :]
    section = section + half_thickness * np.sin(turn)[None, :, None] * np.array([0.0, 0.0, 1.0])
    vertices = [*(line[:, None, :] + section).reshape(-1, 3), line[0], line[-1]]
    first, last = len(vertices) - 2, len(vertices) - 1
    top = sides * (len(line) - 1)
    triangles = []
    for k in range(sides):
        m = (k + 1) % sides
        for ring in range(0, top, sides):
            p, q, r, s = ring + k, ring + m, ring + sides + k, ring + sides + m
            triangles += [(p, q, r), (q, s, r)]
        triangles += [(first, m, k), (last, top + k, top + m)]
    return np.array(vertices).T, np.array(triangles).T
