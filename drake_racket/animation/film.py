"""Draws the scene as a film, GIF or MP4, by matplotlib: neither a GPU nor a display is needed."""

from __future__ import annotations

import contextlib
import importlib
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.animation import page
from drake_racket.animation.camera import place_camera
from drake_racket.animation.limb_shape import limb_parts
from drake_racket.animation.outline import racket_outline, spring_ends, string_points
from drake_racket.animation.scene import Scene
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Progress, Report
from drake_racket.plant.shapes import seam
from drake_racket.plots.style import as_written, new_figure

_WIDTH, _HEIGHT, _DPI = 9.6, 6.0, 100  # inches, 1/inch: even numbers of pixels, as MP4 wants
_GIF_COLOURS = 96


def check_film(path: Path) -> None:
    """Refuses a film that no installed program can write.

    Raises:
        InputError: MP4 without ffmpeg.

    """
    if path.suffix.lower() == ".mp4" and _ffmpeg() is None:
        allowed = ".html or .gif, or install ffmpeg (pip install 'drake-racket[video]')"
        raise InputError("--out", path, allowed)


def write_film(scene: Scene, path: Path, progress: Report | None = None) -> None:
    """Draws every frame of `scene` into `path` (.gif or .mp4).

    Raises:
        InputError: ffmpeg cannot write H.264.

    """
    if path.suffix.lower() == ".gif":
        _write_gif(_frames(scene, progress), scene.fps, path)
    else:
        _write_mp4(_frames(scene, progress), scene.fps, path)


def _frames(scene: Scene, progress: Report | None) -> Iterator[NDArray[np.uint8]]:
    """The frames as pixels (height, width, 3)."""
    picture = _Picture(scene)
    for k in range(len(scene.time)):
        yield picture.pixels(k)
        if progress is not None:
            progress(Progress("frames", k + 1, len(scene.time)))


def _write_gif(frames: Iterator[NDArray[np.uint8]], fps: float, path: Path) -> None:
    """All frames take the palette of the first, which shows every colour."""
    from PIL import Image

    first = Image.fromarray(next(frames)).quantize(_GIF_COLOURS)
    rest = (
        Image.fromarray(pixels).quantize(palette=first, dither=Image.Dither.NONE)
        for pixels in frames
    )
    first.save(path, save_all=True, append_images=rest, duration=round(1e3 / fps), loop=0)


def _write_mp4(frames: Iterator[NDArray[np.uint8]], fps: float, path: Path) -> None:
    size = f"{round(_WIDTH * _DPI)}x{round(_HEIGHT * _DPI)}"
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", f"{fps:g}", "-i", "-"]
    film = ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart", str(path)]
    command = [_ffmpeg() or "ffmpeg", "-y", "-loglevel", "error", *source, *film]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        assert process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # it has ended: its status tells
            for pixels in frames:
                process.stdin.write(pixels.tobytes())
            process.stdin.close()
    if process.returncode:
        raise InputError("--out", path, "an ffmpeg that writes H.264, or .html or .gif")


def _ffmpeg() -> str | None:
    """The program: the one on the path, or imageio-ffmpeg's."""
    found = shutil.which("ffmpeg")
    if found is None:
        try:
            found = str(importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe())
        except (ImportError, RuntimeError):
            return None
    return found


class _Picture:
    """One figure whose artists take each frame's coordinates, seen through the camera."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.camera = scene, place_camera(scene)
        outline = racket_outline(scene.geometry)
        self._lines = [  # body, line (k, 3) in it
            *((scene.handle, line) for line in outline.handle_arms),
            *((scene.head, line) for line in outline.head_arms),
            (scene.head, outline.rim),
        ]
        self._grip = outline.grip
        self._rest = string_points(scene.geometry)
        self._springs = spring_ends(scene.geometry)
        self._spheres, self._segments = limb_parts(scene)
        self._moving: list[Any] = []
        self._canvas = self._make_artists()
        self._canvas.draw()
        self._still = self._canvas.copy_from_bbox(self._axes.bbox)

    def pixels(self, k: int) -> NDArray[np.uint8]:
        """Frame k, (height, width, 3): what moves, over what does not."""
        self._place(k)
        self._canvas.restore_region(self._still)
        for artist in sorted(self._moving, key=lambda a: a.get_zorder()):
            self._axes.draw_artist(artist)
        return np.ascontiguousarray(np.asarray(self._canvas.buffer_rgba())[:, :, :3])

    def _place(self, k: int) -> None:
        """Moves every artist to frame k."""
        scene, project = self.scene, self.camera.project
        self._handle.set_xy(project(_placed(scene.handle, self._grip, k)))
        for artist, (body, line) in zip(self._frame, self._lines, strict=True):
            artist.set_data(*project(_placed(body, line, k)).T)
        points = self._rest + scene.strings[k][:, None] * [0.0, 0.0, 1.0]
        ends = []
        for i, j, vector in self._springs:
            end = points[j - 1] if j else self._rest[i - 1] + vector
            ends.append((points[i - 1], end))
        self._strings.set_segments(list(project(_placed(scene.head, np.array(ends), k))))
        self._points.set_data(*project(_placed(scene.head, points, k)).T)
        self._ball.set_xy(self._hull(_placed(scene.ball, _sphere() * scene.ball_axes[k], k)))
        self._seam.set_data(*self._seam_seen(k).T)
        # seen from the other side of the strings, the ball is behind them
        normal = scene.head.rotation[k].as_matrix()[:, 2]
        before = normal @ (self.camera.place - scene.head.place[k]) > 0.0
        self._ball.set_zorder(6 if before else 3)
        self._seam.set_zorder(6.5 if before else 3.5)
        for artist, (_, places, radius) in zip(self._joints, self._spheres, strict=True):
            artist.set_xy(self._hull(places[k] + radius * _sphere()))
        for artist, (body, length, radius) in zip(self._parts, self._segments, strict=True):
            artist.set_xy(self._hull(_placed(body, _cylinder(radius, length[k]), k)))
        touching = ", in contact" if scene.in_contact[k] else ""
        self._now.set_text(
            f"{1e3 * scene.time[k]:.2f} ms from touch{touching};  force {scene.force[k]:.0f} N;"
            f"  frame bent out of plane {np.degrees(scene.bending[k]):.2f}°"
        )

    def _seam_seen(self, k: int) -> NDArray[np.float64]:
        """The seam of a ball that spins, where it is on the camera's side; NaN elsewhere."""
        scene = self.scene
        if scene.ball_turn is None:
            return np.full((1, 2), np.nan)
        points = _placed(scene.ball, scene.ball_turn[k].apply(seam(1.0)) * scene.ball_axes[k], k)
        away = scene.ball.place[k]
        hidden = (points - away) @ (self.camera.place - away) < 0.0
        seen = np.array(self.camera.project(points))
        seen[hidden] = np.nan
        return seen

    def _hull(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        from scipy.spatial import ConvexHull

        seen = self.camera.project(points)
        return np.asarray(seen[ConvexHull(seen).vertices])

    def _make_artists(self) -> Any:
        """Fills the figure; returns its canvas."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.collections import LineCollection
        from matplotlib.patches import Polygon

        figure = new_figure(_WIDTH, _HEIGHT)
        figure.set_layout_engine("none")
        figure.set_dpi(_DPI)
        axes = self._axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        wide = _WIDTH / _HEIGHT
        axes.set(xlim=(-wide, wide), ylim=(-1.0, 1.0), aspect="equal")
        axes.axis("off")

        def moving(artist: Any) -> Any:
            artist.set_animated(True)
            self._moving.append(artist)
            return artist

        def shape(colour: str, order: float) -> Any:
            corners = np.zeros((3, 2))
            patch = Polygon(corners, facecolor=colour, edgecolor="black", lw=0.5, zorder=order)
            return moving(axes.add_patch(patch))

        self._parts = [shape(page.LIMB, 1.0) for _ in self._segments]
        self._handle = shape(page.FRAME, 2.0)
        style: dict[str, Any] = {"color": page.FRAME, "lw": 4.0, "solid_capstyle": "round"}
        self._frame = [moving(axes.plot([], [], zorder=2.0, **style)[0]) for _ in self._lines]
        # the hand closes around the handle
        self._joints = [
            shape(page.LIMB, 2.5 if name.startswith("hand") else 1.0)
            for name, _, _ in self._spheres
        ]
        strings = LineCollection([], colors=page.STRINGS, linewidths=1.2, zorder=4.0)
        self._strings = moving(axes.add_collection(strings))
        dots: dict[str, Any] = {"color": page.POINTS, "ms": 4.0, "zorder": 5.0}
        self._points = moving(axes.plot([], [], "o", **dots)[0])
        self._ball = shape(page.BALL, 6.0)
        self._seam = moving(axes.plot([], [], color="white", lw=1.2, zorder=6.5)[0])
        left = 0.04 - wide
        self._now = moving(axes.text(left, 0.72, "", fontsize=9, weight="bold", zorder=9.0))
        self._write_words(left)
        return FigureCanvasAgg(figure)

    def _write_words(self, left: float) -> None:
        """What does not move: title, legend, bar for the scale."""
        axes = self._axes
        axes.text(left, 0.92, as_written(self.scene.title), fontsize=11, weight="bold")
        rows = [page.case_text(self.scene), page.exaggeration_text(self.scene)]
        for row, text in enumerate(rows):
            axes.text(left, 0.85 - 0.065 * row, text, fontsize=9)
        entries = page.legend(self.scene)
        handles = [axes.plot([], [], color=colour, lw=5)[0] for colour, _ in entries[:-1]]
        ends = self.camera.project(self.camera.bar)
        handles.append(axes.plot(*ends.T, color=entries[-1][0], lw=2.5)[0])
        labels = [text for _, text in entries]
        axes.legend(handles, labels, loc="lower center", ncols=6, fontsize=8, frameon=False)


def _placed(body: Any, points: NDArray[np.float64], k: int) -> NDArray[np.float64]:
    """Points (..., 3) of a body in the world at frame k."""
    return np.asarray(body.place[k] + points @ body.rotation[k].as_matrix().T)


def _sphere() -> NDArray[np.float64]:
    """Points on a unit sphere, evenly (golden angle), (k, 3)."""
    count = 300
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    wide = np.sqrt(1.0 - z * z)
    return np.column_stack([wide * np.cos(turn), wide * np.sin(turn), z])


def _cylinder(radius: float, length: float) -> NDArray[np.float64]:
    """Points on the edges of a cylinder along z, midway at 0, (k, 3) m."""
    turn = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    x, y, end = radius * np.cos(turn), radius * np.sin(turn), np.full(len(turn), 0.5 * length)
    return np.concatenate([np.column_stack([x, y, end]), np.column_stack([x, y, -end])])
