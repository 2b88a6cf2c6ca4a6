"""Draws assessed rackets beside each other, on common scales."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.compare.numbers import BY_NAME, NINE
from drake_racket.compare.spread import Assessed
from drake_racket.plots.style import CYCLE, draw_outline, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MARKS = ("o", "s", "D", "^", "v", "P")
MOST = len(CYCLE)
"""Rackets in one comparison."""

_BARS = (
    "peak_handle_acceleration",
    "handle_ringing",
    "peak_hand_force",
    "peak_hand_torque",
)


def maps_figure(rackets: Sequence[Assessed]) -> Figure:
    """Draws apparent restitution at the nine points, a racket a panel."""
    values = [np.array([a.nominal.values[name] for name in NINE]) for a in rackets]
    low, high = min(v.min() for v in values), max(v.max() for v in values)
    figure = new_figure(2.7 * len(rackets) + 1.2, 4.4)
    panels = figure.subplots(1, len(rackets), squeeze=False)[0]
    tops = [_top(a) for a in rackets]
    widest = 1e3 * max(a.racket.string_bed.rim_semi_axis_y.value for a in rackets) + 8.0
    for axes, found, numbers in zip(panels, rackets, values, strict=True):
        racket = found.racket
        draw_outline(axes, racket, along_x=False)
        places = np.array([racket.point(i) for i in range(1, 10)])
        dots = axes.scatter(
            -1e3 * places[:, 1],
            1e3 * places[:, 0],
            c=numbers,
            s=650,
            cmap="cividis",
            vmin=low,
            vmax=high,
            zorder=2,
        )
        for place, number, name in zip(places, numbers, NINE, strict=True):
            colour = "white" if number < low + 0.5 * (high - low) else "black"
            text, sd = f"{number:.2f}", found.sd[name]
            text += f"\n±{sd:.2f}" if sd >= 0.005 else ""
            axes.text(
                -1e3 * place[1],
                1e3 * place[0],
                text,
                ha="center",
                va="center",
                color=colour,
                fontsize=7.5,
                zorder=3,
            )
        axes.set_title(racket.title, fontsize=9, wrap=True)
        axes.set_xlim(-widest, widest)
        axes.set_ylim(min(t[0] for t in tops), max(t[1] for t in tops))
        axes.set_axis_off()
    figure.colorbar(dots, ax=panels, shrink=0.7, label="apparent restitution")
    figure.suptitle("Free racket, ball straight on: what comes back, point by point")
    return figure


def _top(found: Assessed) -> tuple[float, float]:
    """What of a racket is drawn (mm from the butt): from below the rim to the tip."""
    racket, bed = found.racket, found.racket.string_bed
    centre = racket.centre()[0]
    tip = racket.handle.length.value + racket.head.length.value
    return 1e3 * (centre - bed.rim_semi_axis_x.value) - 40.0, 1e3 * tip + 8.0


def axis_figure(rackets: Sequence[Assessed]) -> Figure:
    """Draws restitution and the swing's ball speed along the long axis."""
    cell = 0.5e3 * rackets[0].racket.string_bed.spacing.value
    figure = new_figure(9.6, 4.6)
    restitution, speed = figure.subplots(1, 2)
    for colour, mark, found in zip(CYCLE, MARKS, rackets, strict=False):
        x = 1e3 * found.nominal.offsets
        style: dict[str, Any] = {"color": colour, "marker": mark, "ms": 4}
        restitution.plot(x, found.nominal.restitution, label=found.racket.title, **style)
        speed.plot(x, found.nominal.ball_speed, **style)
        middle = int(np.argmin(np.abs(x)))
        for axes, y, name in (
            (restitution, found.nominal.restitution, NINE[4]),
            (speed, found.nominal.ball_speed, "swing_speed_centre"),
        ):
            _error_bar(axes, x[middle], y[middle], found.sd[name], colour)
    for axes in (restitution, speed):
        axes.set_xlabel("aim from the string-bed centre, towards the tip (mm)")
        axes.axvline(0.0, color="0.85", lw=0.8, zorder=0)
        for side in (-cell, cell):
            axes.axvline(side, color="0.7", lw=0.8, ls=(0, (5, 4)), zorder=0)
        tidy(axes)
    restitution.set(ylabel="apparent restitution", title="What comes back")
    speed.set(ylabel="ball speed after the swing (m/s)", title="Ball speed for the same swing")
    figure.legend(loc="outside lower center", ncols=min(len(rackets), 3), frameon=False, fontsize=9)
    figure.suptitle(
        "Along the long axis (bars: what inferred numbers leave open; dashed: from here on the ball"
        " meets the next string mass)",
        fontsize=10,
    )
    return figure


def _error_bar(axes: Any, x: float, y: float, sd: float, colour: str) -> None:
    if sd > 0.0:
        axes.errorbar(x, y, yerr=sd, color=colour, capsize=4, lw=1.2, zorder=3)


def hand_figure(rackets: Sequence[Assessed]) -> Figure:
    """Draws what reaches the handle and the hand, with error bars, each scale from 0."""
    figure = new_figure(9.6, 1.5 + 0.42 * len(rackets))
    panels = figure.subplots(1, len(_BARS), sharey=True)
    rows = np.arange(len(rackets))[::-1]
    for axes, name in zip(panels, _BARS, strict=True):
        number = BY_NAME[name]
        values = [number.factor * a.nominal.values[name] for a in rackets]
        errors = [number.factor * a.sd[name] for a in rackets]
        for row, value, error, colour, mark in zip(
            rows, values, errors, CYCLE, MARKS, strict=False
        ):
            axes.errorbar(
                value, row, xerr=error or None, color=colour, marker=mark, ms=6, capsize=3
            )
        axes.set_xlim(0.0, 1.18 * max(v + e for v, e in zip(values, errors, strict=True)))
        axes.set_ylim(-0.6, len(rackets) - 0.4)
        axes.set_xlabel(f"{_SHORT[name]} ({number.shown})", fontsize=9)
        axes.grid(axis="x", color="0.9")
        tidy(axes)
    panels[0].set_yticks(rows, [a.racket.title for a in rackets], fontsize=9)
    figure.suptitle("Ball at the centre: what shakes the handle, and what the hand takes")
    return figure


_SHORT = {
    "peak_handle_acceleration": "peak acceleration,\nmid-handle",
    "handle_ringing": "ringing after release,\nRMS",
    "peak_hand_force": "peak force\non the hand",
    "peak_hand_torque": "peak torque\non the hand",
}
