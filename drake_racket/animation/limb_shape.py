"""Sketches hand and limb as capsules between their landmarks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from drake_racket.animation.scene import Pose, Scene

_THICKNESS = 0.14  # radius per length of a segment
_RADII = (0.018, 0.045)  # m, least and most; that of a hand without a limb is between
_HAND = 0.03  # m


def limb_parts(
    scene: Scene,
) -> tuple[
    list[tuple[str, NDArray[np.float64], float]],
    list[tuple[Pose, NDArray[np.float64], float]],
]:
    """Tells what to draw of hand and limb.

    Returns:
        Spheres (landmark, places (n, 3), radius), and segments (a body with its origin midway and
        its z along the segment, lengths (n,), radius). All in m.

    """
    places, segments = scene.landmarks, []
    radii = {name: _HAND if name.startswith("hand") else 0.0 for name in places}
    for start, end in scene.geometry.segments:
        vector = places[end] - places[start]
        length = np.linalg.norm(vector, axis=1)
        radius = float(np.clip(_THICKNESS * length.mean(), *_RADII))
        middle = 0.5 * (places[start] + places[end])
        segments.append((Pose(middle, _along(vector)), length, radius))
        for name in (start, end):
            radii[name] = max(radii[name], radius)
    return [(name, places[name], radii[name]) for name in places], segments


def _along(vectors: NDArray[np.float64]) -> Rotation:
    """Rotations that turn z into (n, 3) vectors, or all their opposites: a cylinder has two ends.

    Of the two the one nearer to z, where the shortest turn is far from its singularity at -z.
    """
    z = vectors / np.maximum(np.linalg.norm(vectors, axis=1), 1e-9)[:, None]
    if z[:, 2].mean() < 0.0:
        z = -z
    quaternion = np.column_stack([-z[:, 1], z[:, 0], np.zeros(len(z)), 1.0 + z[:, 2]])
    quaternion[np.linalg.norm(quaternion, axis=1) < 1e-6] = [1.0, 0.0, 0.0, 0.0]
    return Rotation.from_quat(quaternion)
