"""Puts the scene into Drake's Meshcat and saves one page that needs no server.

The scene's tree: `/racket/handle`, `/racket/head` and below it `point_1`, `point_2`, ... with the
springs that start there, `/ball`, `/limb`. Each frame places the two bodies, the ball, the limb and
the points. A spring is a line from the origin to (1, 0, 1) or (0, 1, 1), and its `scale` is
the vector between its ends: exact between frames too.
"""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import (
    Cylinder,
    Meshcat,
    MeshcatAnimation,
    MeshcatParams,
    Rgba,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix

from drake_racket.animation import page
from drake_racket.animation.camera import FIELD_OF_VIEW, place_camera
from drake_racket.animation.limb_shape import limb_parts
from drake_racket.animation.outline import racket_outline, spring_ends, string_points, tube
from drake_racket.animation.scene import Pose, Scene
from drake_racket.plant.shapes import (
    GRIP_HALF_THICKNESS,
    GRIP_HALF_WIDTH,
    SEAM_COLOUR,
    TUBE_RADIUS,
    seam,
)

_POINT_RADIUS = 0.004  # m, drawn only
_STRING_HALF_WIDTH = 0.0007  # m, drawn only
_FLAT = 1e-6  # m: a scale of 0 would leave a line without a direction


def meshcat_page(scene: Scene) -> str:
    """Makes the text of a page. A server on a free port of this host is up meanwhile."""
    # 0: the system chooses a port, so that any number of these may run at once
    with _without_its_address():
        meshcat = Meshcat(MeshcatParams(host="localhost", port=0, show_stats_plot=False))
    animation = MeshcatAnimation(scene.fps)
    _dress(meshcat, scene)
    _add_racket(meshcat, animation, scene)
    _add_strings(meshcat, animation, scene)
    _add_ball(meshcat, animation, scene)
    _add_limb(meshcat, animation, scene)
    animation.set_autoplay(True)
    animation.set_loop_mode(MeshcatAnimation.LoopMode.kLoopRepeat)
    animation.set_repetitions(1_000_000)
    meshcat.SetAnimation(animation)
    return page.finish_page(meshcat.StaticHtml(), scene)


@contextlib.contextmanager
def _without_its_address() -> Iterator[None]:
    """Without the log's line with an address, which is gone when the user reads it."""
    logger = logging.getLogger("drake")

    def other(record: logging.LogRecord) -> bool:
        return "listening for connections" not in record.getMessage()

    logger.addFilter(other)
    try:
        yield
    finally:
        logger.removeFilter(other)


def _dress(meshcat: Meshcat, scene: Scene) -> None:
    """Background, camera, and a bar for the scale."""
    for name in ("top_color", "bottom_color"):
        meshcat.SetProperty("/Background/<object>", name, [1.0, 1.0, 1.0])
    for path in ("/Grid", "/Axes"):
        meshcat.SetProperty(path, "visible", False)
    camera = place_camera(scene)
    lens = Meshcat.PerspectiveCamera(fov=float(np.degrees(FIELD_OF_VIEW)))
    meshcat.SetCamera(lens, "/Cameras/default/rotated")
    meshcat.SetCameraPose(camera.place, camera.target)
    meshcat.SetLine("/bar", camera.bar.T, 4.0, _rgba("#000000"))


def _add_racket(meshcat: Meshcat, animation: MeshcatAnimation, scene: Scene) -> None:
    outline, colour = racket_outline(scene.geometry), _rgba(page.FRAME)
    axis = np.array([[0.0, 0.0, 0.0], [outline.grip[0, 0], 0.0, 0.0]])
    tubes = {"handle/grip": tube(axis, GRIP_HALF_WIDTH, GRIP_HALF_THICKNESS)}
    tubes["head/rim"] = tube(outline.rim, TUBE_RADIUS, TUBE_RADIUS)
    for side in (0, 1):
        tubes[f"handle/arm_{side}"] = tube(outline.handle_arms[side], TUBE_RADIUS, TUBE_RADIUS)
        tubes[f"head/arm_{side}"] = tube(outline.head_arms[side], TUBE_RADIUS, TUBE_RADIUS)
    for name, (vertices, triangles) in tubes.items():
        meshcat.SetTriangleMesh(f"/racket/{name}", vertices, triangles, colour)
    _move(animation, "/racket/handle", scene.handle)
    _move(animation, "/racket/head", scene.head)


def _add_strings(meshcat: Meshcat, animation: MeshcatAnimation, scene: Scene) -> None:
    rest, heights = string_points(scene.geometry), scene.strings
    for i, place in enumerate(rest):
        path = f"/racket/head/point_{i + 1}"
        meshcat.SetObject(f"{path}/mass", Sphere(_POINT_RADIUS), _rgba(page.POINTS))
        _set(animation, path, "position", place + heights[:, i, None] * [0.0, 0.0, 1.0])
    for row, (i, j, vector) in enumerate(spring_ends(scene.geometry)):
        path = f"/racket/head/point_{i}/spring_{row}"
        along = np.array([1.0 if v else 0.0 for v in vector[:2]] + [1.0])
        ends = np.column_stack([np.zeros(3), along])
        meshcat.SetLine(f"{path}/line", ends, 1.0, _rgba(page.STRINGS))
        ribbon = _ribbon(along)
        meshcat.SetTriangleMesh(f"{path}/ribbon", *ribbon, _rgba(page.STRINGS))
        rise = (heights[:, j - 1] if j else 0.0) - heights[:, i - 1]
        scale = np.tile(np.where(vector == 0.0, 1.0, vector), (len(rise), 1))
        scale[:, 2] = np.where(np.abs(rise) < _FLAT, _FLAT, rise)
        _set(animation, path, "scale", scale)


def _ribbon(along: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A spring's width in the string plane, which its scale leaves alone; seen from both sides."""
    side = _STRING_HALF_WIDTH * np.array([along[1], along[0], 0.0])
    corners = np.array([side, -side, along + side, along - side])
    triangles = [(0, 1, 2), (1, 3, 2), (2, 1, 0), (2, 3, 1)]
    return corners.T, np.array(triangles).T


def _add_ball(meshcat: Meshcat, animation: MeshcatAnimation, scene: Scene) -> None:
    meshcat.SetObject("/ball/shape", Sphere(1.0), _rgba(page.BALL))
    # a little above the felt; it is flattened with the ball
    meshcat.SetLine("/ball/shape/seam", seam(1.01).T, 2.0, Rgba(*SEAM_COLOUR))
    _move(animation, "/ball", scene.ball)
    _set(animation, "/ball/shape", "scale", scene.ball_axes)
    if scene.ball_turn is not None:
        still = Pose(np.zeros_like(scene.ball.place), scene.ball_turn)
        _move(animation, "/ball/shape/seam", still)


def _add_limb(meshcat: Meshcat, animation: MeshcatAnimation, scene: Scene) -> None:
    """Capsules: a cylinder per segment, with spheres at the landmarks."""
    colour = _rgba(page.LIMB)
    balls, segments = limb_parts(scene)
    for name, places, radius in balls:
        path = f"/limb/{name}"
        meshcat.SetObject(path, Sphere(radius), colour)
        _set(animation, path, "position", places)
    for i, (segment, length, radius) in enumerate(segments):
        path = f"/limb/segment_{i}"
        meshcat.SetObject(f"{path}/shape", Cylinder(radius, 1.0), colour)
        _move(animation, path, segment)
        scale = np.column_stack([np.ones((len(length), 2)), length])
        _set(animation, f"{path}/shape", "scale", scale)


def _move(animation: MeshcatAnimation, path: str, pose: Pose) -> None:
    matrices = pose.rotation.as_matrix()
    for k, (place, matrix) in enumerate(zip(pose.place, matrices, strict=True)):
        animation.SetTransform(k, path, RigidTransform(RotationMatrix(matrix), place))


def _set(animation: MeshcatAnimation, path: str, name: str, values: NDArray[np.float64]) -> None:
    """One vector per frame; a run of equal ones keeps its two ends."""
    same = np.all(values[1:] == values[:-1], axis=1)
    inner = np.r_[False, same[1:] & same[:-1], False] if len(same) > 1 else np.zeros(2, bool)
    for k in np.flatnonzero(~inner):
        animation.SetProperty(int(k), path, name, [float(v) for v in values[k]])


def _rgba(colour: str) -> Rgba:
    r, g, b = (int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    return Rgba(r, g, b, 1.0)
