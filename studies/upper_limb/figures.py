"""Figure of the upper limb: joints with their positive directions, and frames, in three views."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_racket import load_racket
from drake_racket.plots import BLUE, GREEN, GREY, VERMILION, frame_lines, new_figure, tidy

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


class _View(NamedTuple):
    """A projection: world axes to the right and up on paper; the viewer is on right x up."""

    title: str
    right: tuple[float, float, float]
    up: tuple[float, float, float]
    labels: tuple[str, str]


_VIEWS = (
    _View("from the right", (1, 0, 0), (0, 0, 1), ("x, forward (m)", "z, up (m)")),
    _View("from the front", (0, 1, 0), (0, 0, 1), ("y, to the left (m)", "z, up (m)")),
    _View("from above", (0, -1, 0), (1, 0, 0), ("y, to the left (m)", "x, forward (m)")),
)
_SEGMENTS = (("shoulder", "elbow", 7.0), ("elbow", "wrist", 5.5), ("wrist", "knuckle", 8.0))
_TRIAD = (("x", VERMILION), ("y", GREEN), ("z", BLUE))
_THUMB = 0.05  # m, drawn only
_RACKET = 0.7  # m of the racket's axis: room for the racket, which reaches 0.58 m beyond the grip
_MARGIN = 0.16  # m around what is drawn


def upper_limb_figure(zero: xarray.Dataset, posture: xarray.Dataset, title: str) -> Figure:
    """The zero posture with the joints' positive directions, and a posture with the hand frame.

    Args:
        zero: of `limb_posture`, all joints at zero.
        posture: of `limb_posture`, any posture of the same limb.
        title: of the figure, which names limb and posture.

    """
    figure = new_figure(11.0, 8.8)
    panels = figure.subplots(2, 3)
    for axes, view in zip(panels[0], _VIEWS, strict=True):
        _draw_limb(axes, zero, view)
        _draw_positive_directions(axes, zero, view)
        _finish(axes, zero, view, f"all joints at zero, {view.title}")
    for axes, view in zip(panels[1], _VIEWS, strict=True):
        _draw_limb(axes, posture, view)
        _draw_hand_frame(axes, posture, view)
        _finish(axes, posture, view, f"posture, {view.title}")
    figure.suptitle(title)
    handles, labels = panels[1][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    return figure


def _flat(points: Any, view: _View) -> NDArray[np.float64]:
    """World points (..., 3) on paper (..., 2)."""
    flat: NDArray[np.float64] = np.asarray(points) @ np.array([view.right, view.up]).T
    return flat


def _draw_limb(axes: Any, posture: xarray.Dataset, view: _View) -> None:
    origin = posture["frame_origin"]
    for start, end, width in _SEGMENTS:
        line = _flat(origin.sel(frame=[start, end]).to_numpy(), view)
        axes.plot(*line.T, color="0.78", lw=width, solid_capstyle="round", zorder=1)
    knuckle = posture.sel(frame="knuckle")
    tip = knuckle["frame_origin"].to_numpy()
    wrist = origin.sel(frame="wrist").to_numpy()
    root = wrist + 0.45 * (tip - wrist)
    thumb = np.array([root, root + _THUMB * knuckle["frame_axes"].sel(direction="x").to_numpy()])
    axes.plot(*_flat(thumb, view).T, color="0.78", lw=4, solid_capstyle="round", zorder=1)
    joints = _flat(origin.sel(frame=["shoulder", "elbow", "wrist"]).to_numpy(), view)
    axes.plot(*joints.T, "o", color="0.25", ms=5, zorder=3)


def _draw_positive_directions(axes: Any, zero: xarray.Dataset, view: _View) -> None:
    """An arrow for each joint whose axis points to the viewer or away, the way it turns."""
    from matplotlib.patches import FancyArrowPatch

    toward = np.cross(view.right, view.up)
    radius = 0.06
    for name in zero["joint"].to_numpy():
        joint = zero.sel(joint=name)
        turn = float(joint["joint_axis"].to_numpy() @ toward)
        if abs(turn) < 0.99:
            continue
        centre = _flat(joint["joint_centre"].to_numpy(), view)
        along = abs(joint["joint_axis"].to_numpy()[2]) > 0.99  # seen from its end: start at thumb
        start = 0.5 * np.pi if along else -0.5 * np.pi
        angle = start + np.sign(turn) * np.linspace(0.0, 0.5 * np.pi, 31)
        arc = centre + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        axes.plot(*arc[:-2].T, color=VERMILION, lw=1.8, zorder=4)
        head = FancyArrowPatch(
            arc[-3], arc[-1], arrowstyle="-|>", mutation_scale=13, color=VERMILION, zorder=4
        )
        axes.add_patch(head)
        side = np.sign(arc[-1, 0] - centre[0])
        axes.annotate(
            name.replace("_", "\n"),
            arc[-1] + ((0.0, -0.01) if along else (side * 0.015, 0.0)),
            ha="center" if along else "left" if side > 0 else "right",
            va="top" if along else "center",
            fontsize=8.5,
        )
        radius += 0.08 if along else 0.0
    if view is _VIEWS[0]:  # from the right no arrow turns back
        for name in ("shoulder", "elbow", "wrist", "knuckle"):
            x, y = _flat(zero["frame_origin"].sel(frame=name).to_numpy(), view)
            axes.annotate(name, (x - 0.025, y), ha="right", va="center", fontsize=9, color=GREY)


def _draw_hand_frame(axes: Any, posture: xarray.Dataset, view: _View) -> None:
    """The frame that the racket's grip frame lies on, and the tour racket in it."""
    hand = posture.sel(frame="hand")
    origin = hand["frame_origin"].to_numpy()
    start = _flat(origin, view)
    axes_of_hand = np.array(
        [hand["frame_axes"].sel(direction=name).to_numpy() for name in ("x", "y", "z")]
    )
    for line in _racket_lines():
        axes.plot(*_flat(origin + line @ axes_of_hand, view).T, color="0.45", lw=1.3, zorder=2)
    texts = {
        "x": "hand x: butt to tip",
        "y": "hand y",
        "z": "hand z: normal of the strings on the ball's side",
    }
    for name, colour in _TRIAD:
        direction = hand["frame_axes"].sel(direction=name).to_numpy()
        end = _flat(origin + 0.12 * direction, view)
        axes.plot(*np.stack([start, end]).T, color=colour, lw=2.2, zorder=5, label=texts[name])
        axes.plot(*end, ".", color=colour, ms=7, zorder=5)
    axes.plot(*start, "o", color="black", ms=5, zorder=6, label="grip centre")


def _racket_lines() -> list[NDArray[np.float64]]:
    """The tour racket's outline from its grip, (k, 3) m in the hand's axes."""
    racket = load_racket("tour")
    bed, throat = racket.string_bed, racket.handle.length.value
    a, b = bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
    lines = frame_lines(throat, bed.gsc.value, a, b)
    along = np.array([throat, 0.0, 0.0])
    on_head = [line + along for line in (lines.rim, *lines.head_arms)]
    grip = np.array([racket.landmarks.grip.value, 0.0, 0.0])
    return [line - grip for line in (lines.grip, *lines.handle_arms, *on_head)]


def _finish(axes: Any, posture: xarray.Dataset, view: _View, title: str) -> None:
    points = posture["frame_origin"].to_numpy()
    if title.startswith("posture"):
        hand = posture.sel(frame="hand")
        tip = hand["frame_origin"] + _RACKET * hand["frame_axes"].sel(direction="x")
        points = np.vstack([points, tip.to_numpy()])
    low, high = points.min(axis=0), points.max(axis=0)
    middle = _flat(0.5 * (low + high), view)
    size = np.abs(_flat(high - low, view)) if title.startswith("all") else high - low
    half = 0.5 * float(size.max()) + _MARGIN
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    axes.set_aspect("equal")
    axes.set_title(title, fontsize=10)
    if sum(view.right) < 0:  # paper's right is -y: the ticks show y
        axes.xaxis.set_major_formatter(lambda value, _: f"{-value + 0.0:.1f}")
    axes.set_xlabel(view.labels[0])
    axes.set_ylabel(view.labels[1])
    tidy(axes)
