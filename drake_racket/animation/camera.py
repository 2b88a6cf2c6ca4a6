"""Chooses where an animation is seen from: racket, ball and limb in view, strings' face visible."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_racket.animation.outline import racket_outline
from drake_racket.animation.scene import Scene

FIELD_OF_VIEW = np.radians(35.0)  # from the bottom to the top of the picture
_ASPECT = 1.6  # of the window that the picture is laid out for
_MARGIN = 1.08
_TOP, _BOTTOM = 0.22, 0.07  # of the picture's height, taken by words
SCALE_BAR = 0.1  # m
_BELOW = 0.03  # m, from the scene to the bar
_NEAR = 0.15  # m: the ball is kept in view while it is nearer than this to the strings


@dataclass(frozen=True)
class Camera:
    """Holds a pinhole camera: its place and what it looks at (m, in the world); world z points up.

    bar: (2, 3) ends of a horizontal bar for the scale, below the scene on its left.
    """

    place: NDArray[np.float64]
    target: NDArray[np.float64]
    bar: NDArray[np.float64]

    def axes(self) -> NDArray[np.float64]:
        """Gives unit vectors to the right, up, and from the target to the camera, as rows."""
        return _axes(self.place - self.target)

    def project(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gives the points (..., 3) in the picture, (..., 2): 1 is half the picture's height."""
        right, up, back = self.axes()
        seen = points - self.place
        depth = np.maximum(-(seen @ back), 1e-3) * np.tan(0.5 * FIELD_OF_VIEW)
        return np.stack([seen @ right / depth, seen @ up / depth], axis=-1)


def place_camera(scene: Scene) -> Camera:
    """Looks from the side of the racket that the ball comes from, oblique to the strings."""
    points = _points_of_interest(scene)
    normal = scene.head.rotation[0].as_matrix()[:, 2]
    along = scene.handle.rotation[0].as_matrix()[:, 0]
    sideways = np.cross(along, normal)  # the head's -y, on the reader's side with the tip right
    direction = 0.68 * sideways + 0.72 * normal + 0.12 * along
    if scene.geometry.segments:  # a player: from the side, and from above rather than below
        direction[2] = max(direction[2], 0.15)
    axes = _axes(direction)
    centre = 0.5 * (points.max(axis=0) + points.min(axis=0))
    x, y, depth = ((points - centre) @ axes.T).T
    left, floor = float(x.min()), float(y.min()) - _BELOW
    bar = np.array([[left, floor, 0.0], [left + SCALE_BAR, floor, 0.0]])
    y = np.append(y, floor)
    x, depth = np.append(x, left), np.append(depth, 0.0)
    half = np.tan(0.5 * FIELD_OF_VIEW)
    tall, wide = (1.0 - _TOP - _BOTTOM) * half / _MARGIN, _ASPECT * half / _MARGIN
    distance = np.max(depth + np.maximum(np.abs(y) / tall, np.abs(x) / wide))
    target = centre + (_TOP - _BOTTOM) * half * distance * axes[1]
    return Camera(target + distance * axes[2], target, centre + bar @ axes)


def _axes(back: NDArray[np.float64]) -> NDArray[np.float64]:
    back = back / np.linalg.norm(back)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(back, right), back])


def _points_of_interest(scene: Scene) -> NDArray[np.float64]:
    outline = racket_outline(scene.geometry)
    every = slice(None, None, max(1, len(scene.time) // 50))
    clouds = [
        scene.handle.points(outline.grip)[every],
        scene.head.points(outline.rim)[every],
        *(places[every] for places in scene.landmarks.values()),
    ]
    head = scene.head.rotation.inv().apply(scene.ball.place - scene.head.place)
    near = np.abs(head[:, 2]) < _NEAR
    clouds.append(scene.ball.place[near])
    return np.concatenate([cloud.reshape(-1, 3) for cloud in clouds])
