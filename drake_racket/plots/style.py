"""The figures share what is here: colours, axes, and the racket's outline."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.parameters.racket import RacketParameters
from drake_racket.plant.shapes import frame_lines as frame_lines

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Okabe & Ito's palette: told apart by colour-blind readers and, by lightness, in print
BLUE = "#0072B2"
"""This colour of the figures is from Okabe and Ito's palette: blue."""
VERMILION = "#D55E00"
"""This colour of the figures is from Okabe and Ito's palette: vermilion."""
GREEN = "#009E73"
"""This colour of the figures is from Okabe and Ito's palette: bluish green."""
PURPLE = "#CC79A7"
"""This colour of the figures is from Okabe and Ito's palette: reddish purple."""
ORANGE = "#E69F00"
"""This colour of the figures is from Okabe and Ito's palette: orange."""
SKY = "#56B4E9"
"""This colour of the figures is from Okabe and Ito's palette: sky blue."""
GREY = "0.45"
"""The grey of what is drawn for comparison."""
CYCLE = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
"""Colours of what is compared, in order."""
RACKET_COLOURS = {"tour": BLUE, "recreational": VERMILION}
"""Each shipped racket has one colour in all figures."""
BED_STYLES = {
    ("tour", "low"): (BLUE, "-"),
    ("tour", "high"): (BLUE, "--"),
    ("recreational", "low"): (VERMILION, "-"),
    ("recreational", "high"): (VERMILION, "--"),
}
"""Each shipped racket and tension has one colour and line style in all figures."""


def as_written(text: object) -> str:
    """Gives a user's text for a figure, which shows it as it stands: its $ begin no formula."""
    return str(text).replace("$", r"\$")


def tidy(axes: Any) -> None:
    """Takes the frame's top and right side away."""
    axes.spines[["top", "right"]].set_visible(False)


def new_figure(width: float, height: float) -> Figure:
    """Makes a figure of a `width` and a `height` (inches) that needs no display."""
    from drake_racket.plots.notebook_figure import NotebookFigure

    return NotebookFigure(figsize=(width, height), layout="constrained")


def draw_outline(axes: Any, racket: RacketParameters, *, along_x: bool = True) -> None:
    """Draws rim, throat and handle in the string plane, in mm.

    The rim is the model's ellipse about the string-bed centre; throat and handle are a sketch.

    Args:
        along_x: the racket lies along the axes' x (butt at 0); False: it stands, tip up, seen
            from +z, so that +y is on the left and points 1 2 3 read from left to right.

    """
    bed, length = racket.string_bed, racket.handle.length.value
    a, b = bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
    lines = frame_lines(length, bed.gsc.value, a, b, pieces=180)
    along = np.array([length, 0.0, 0.0])
    arms = [
        np.array([below[0], above[-1] + along])
        for below, above in zip(lines.handle_arms, lines.head_arms, strict=True)
    ]
    for line in (lines.rim + along, lines.grip[:-1], *arms):  # the grip is open at its end
        x, y = line[:, 0], line[:, 1]
        horizontal, vertical = (x, y) if along_x else (-y, x)
        axes.plot(1e3 * horizontal, 1e3 * vertical, color="0.6", lw=1.2, zorder=1)
    axes.set_aspect("equal")
