"""Draws the model with its names, from the parameters: python -m manual.drawing.

Writes docs/figures/model_top.svg (the racket from the ball's side) and model_side.svg (from the
side, bent, with a ball). In both drawings lengths are the tour racket's; what is enlarged says so.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from drake_racket import RacketParameters, load_ball, load_racket
from drake_racket.laws import rest_lengths
from drake_racket.plots import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, frame_lines

FIGURES = Path(__file__).resolve().parents[1] / "docs" / "figures"
COLOURS = {"k1": SKY, "k2": GREEN, "k3": PURPLE, "k4": VERMILION}


def main() -> None:
    """Writes both drawings."""
    racket = load_racket("tour", "low")
    for name, figure in (("model_top", top(racket)), ("model_side", side(racket))):
        # no date and no random names: the same drawing is the same file
        with mpl.rc_context({"svg.hashsalt": name}):
            figure.savefig(FIGURES / f"{name}.svg", metadata={"Date": None})
        print(f"wrote {FIGURES.name}/{name}.svg")


def _axes(width: float, height: float) -> tuple[Figure, Any]:
    figure = Figure(figsize=(width, height), facecolor="white")
    axes = figure.add_axes((0.01, 0.01, 0.98, 0.98))
    axes.set_aspect("equal")
    axes.set_axis_off()
    return figure, axes


def _arrow(axes: Any, start: Any, end: Any, text: str, *, colour: str = "black") -> None:
    style = {"arrowstyle": "-|>", "color": colour, "lw": 1.6, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", end, start, arrowprops=style)
    tip = np.asarray(end) + 0.016 * _unit(np.subtract(end, start))
    axes.text(*tip, text, ha="center", va="center", fontsize=12, style="italic", color=colour)


def _unit(vector: Any) -> Any:
    return vector / np.hypot(*vector)


def _note(axes: Any, text: str, at: Any, target: Any, **how: Any) -> None:
    line = {"arrowstyle": "-", "color": "0.35", "lw": 0.8}
    axes.annotate(text, target, at, arrowprops=line, fontsize=9.5, ha="center", va="center", **how)


def top(racket: RacketParameters) -> Figure:
    """Draws the racket as the ball sees it, tip to the right: x to the right, y upwards."""
    bed, handle = racket.string_bed, racket.handle.length.value
    figure, axes = _axes(10.5, 4.9)
    rim_x, rim_y = bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
    lines = frame_lines(handle, bed.gsc.value, rim_x, rim_y)
    for curve, shift in ((lines.grip, 0.0), (lines.rim, handle)):
        axes.plot(curve[:, 0] + shift, curve[:, 1], color=BLUE, lw=3)
    for curve in lines.handle_arms:
        axes.plot(curve[:, 0], curve[:, 1], color=BLUE, lw=3)
    for curve in lines.head_arms:
        axes.plot(curve[:, 0] + handle, curve[:, 1], color=BLUE, lw=3)
    _springs(axes, racket)
    for number in racket.bed_topology().points:
        x, y, _ = racket.point(number)
        mu = racket.friction.points.value[str(number)].replace("mu", "μ")
        axes.add_patch(Circle((x, y), 0.0085, fc="white", ec="black", zorder=3))
        axes.text(x, y, str(number), ha="center", va="center", fontsize=9, zorder=4)
        axes.text(x + 0.011, y - 0.013, mu, fontsize=8, color="0.3", va="center")
    _arrow(axes, (0.0, 0.0), (0.075, 0.0), "x")
    _arrow(axes, (0.0, 0.0), (0.0, 0.075), "y")
    axes.plot(0.0, 0.0, "ko", ms=4)
    _note(axes, "R: on the butt;\nz towards the reader", (-0.005, -0.075), (0.0, -0.003))
    axes.plot([handle, handle], [-0.1, 0.1], color=ORANGE, lw=1.4, ls="--")
    _note(axes, "throat joint", (handle - 0.065, 0.125), (handle, 0.09))
    grip, place = racket.landmarks.grip.value, racket.landmarks.accelerometer.value
    for at, text, below in ((grip, "grip", -0.06), (place, "accelerometer", -0.06)):
        axes.plot(at, 0.0, "k|", ms=16)
        _note(axes, text, (at, below), (at, -0.012))
    x, y, _ = racket.centre()
    _note(axes, "GSC", (x - 0.034, -0.155), (x - 0.002, -0.009))
    _note(axes, "tip", (handle + racket.head.length.value + 0.03, 0.05), (x + rim_x, 0.0))
    _measure(axes, 0.0, handle, -0.19, "handle (one rigid body)")
    _measure(axes, handle, handle + racket.head.length.value, -0.19, "head (one rigid body)")
    for i, (name, colour) in enumerate(COLOURS.items()):
        axes.plot([0.02, 0.05], [0.17 - 0.021 * i] * 2, color=colour, lw=2.5)
        axes.text(0.057, 0.17 - 0.021 * i, f"springs with {name}", fontsize=9, va="center")
    axes.text(0.02, 0.17 - 0.021 * 4, "p: factor of a rim spring", fontsize=9, va="center")
    axes.set_xlim(-0.05, handle + racket.head.length.value + 0.06)
    axes.set_ylim(-0.22, 0.19)
    return figure


def _springs(axes: Any, racket: RacketParameters) -> None:
    """The springs, each in the colour of its k, with the factor of those that end at the rim."""
    bed, topology = racket.string_bed, racket.bed_topology()
    lengths = rest_lengths(
        topology, bed.spacing.value, bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
    )
    for i, name in enumerate(topology.names):
        formula = bed.springs.value[name]
        start = np.array(racket.point(int(topology.first[i]) + 1)[:2])
        end = start + lengths[i] * topology.directions[i]
        colour = COLOURS[formula.split("*")[-1]]
        axes.plot(*np.transpose([start, end]), color=colour, lw=2, zorder=1)
        if "*" in formula:
            x, y = start + 0.62 * (end - start)
            box = {"fc": "white", "ec": "none", "pad": 0.6}
            axes.text(x, y, formula.split("*")[0], fontsize=8, ha="center", va="center", bbox=box)


def _measure(axes: Any, start: float, end: float, at: float, text: str) -> None:
    style = {"arrowstyle": "<|-|>", "color": "0.35", "lw": 1, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (end, at), (start, at), arrowprops=style)
    axes.text(0.5 * (start + end), at - 0.013, text, ha="center", va="center", fontsize=9.5)


def side(racket: RacketParameters) -> Figure:
    """Draws the racket from the side (x to the right, z up) while a ball presses the strings."""
    handle, head = racket.handle.length.value, racket.head.length.value
    bed, ball = racket.string_bed, load_ball()
    angle, sag, radius = np.radians(-7.0), 0.05, ball.radius.value
    figure, axes = _axes(10.5, 4.0)
    along, normal = (
        np.array([np.cos(angle), np.sin(angle)]),
        np.array([-np.sin(angle), np.cos(angle)]),
    )
    throat = np.array([handle, 0.0])

    def place(x: float, z: float = 0.0) -> Any:
        """A point of the head, from the throat joint along it and normal to it."""
        return throat + x * along + z * normal

    axes.plot([0.0, handle], [0.0, 0.0], color=BLUE, lw=9, solid_capstyle="butt")
    axes.plot(*np.transpose([throat, place(head)]), color=BLUE, lw=2, alpha=0.5)
    centre = bed.gsc.value
    xs = [centre - bed.rim_semi_axis_x.value, *(centre + bed.spacing.value * i for i in (-1, 0, 1))]
    xs.append(centre + bed.rim_semi_axis_x.value)
    zs = [0.0, -0.45 * sag, -sag, -0.45 * sag, 0.0]
    points = np.array([place(x, z) for x, z in zip(xs, zs, strict=True)])
    axes.plot(*points.T, color=VERMILION, lw=2)
    for point in points[1:-1]:
        axes.add_patch(Circle((point[0], point[1]), 0.007, fc="white", ec="black", zorder=3))
    axes.plot([handle, handle + 0.3], [0.0, 0.0], color=GREY, lw=0.8, ls=":")
    axes.add_patch(Circle((handle, 0.0), 0.011, fc=ORANGE, ec="black", zorder=4))
    middle = place(centre, -sag + 0.8 * radius)
    axes.add_patch(
        Circle((middle[0], middle[1]), radius, fc="#E8D44D", ec="black", alpha=0.85, zorder=2)
    )
    axes.plot(*middle, "k.", ms=5, zorder=5)
    _arrow(axes, (0.0, 0.0), (0.07, 0.0), "")
    _arrow(axes, (0.0, 0.0), (0.0, 0.07), "z")
    axes.plot(0.0, 0.0, "ko", ms=4)
    axes.text(0.08, 0.022, "x", fontsize=12, style="italic")
    _arrow(axes, middle + 0.115 * normal, middle + 0.055 * normal, "")
    axes.text(*(middle + 0.125 * normal), "v: the ball", ha="center", fontsize=9.5)
    _arrow(axes, points[2], points[2] - 0.055 * normal, "N, on the strings", colour=VERMILION)
    _note(axes, "throat joint: τ = −kf θ − cf dθ/dt", (handle - 0.03, 0.085), throat)
    axes.text(handle + 0.2, -0.0125, "θ", fontsize=12, style="italic", ha="center", va="center")
    _note(axes, "string mass,\nslides along z of the head", (handle + 0.02, -0.105), points[1])
    _note(
        axes, "spring: T = T0 + k (L − L0)", (handle + 0.33, 0.075), 0.5 * (points[3] + points[4])
    )
    _note(axes, "ball: N = kb x + cb dx/dt,\nx its compression", (handle + 0.05, 0.15), middle)
    note = "Not to scale: the angle is 7°, and the strings' deflection is enlarged."
    axes.text(0.0, -0.135, note, fontsize=9, color="0.35")
    axes.set_xlim(-0.04, handle + head + 0.07)
    axes.set_ylim(-0.15, 0.185)
    return figure


if __name__ == "__main__":
    main()
