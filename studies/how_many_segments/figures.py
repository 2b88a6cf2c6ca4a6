"""The figure: what changes with the number of segments, a panel a number."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.plots import BLUE, VERMILION, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = {0.0: BLUE, 1.0: VERMILION}
NAMES = {0.0: "A: printed moments", 1.0: "B: hoop and exponential handle"}


def segments_figure(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Draws restitution, clamp, hand, handle, wrist and cost over the number of segments."""
    figure = new_figure(12.0, 7.0)
    panels = figure.subplots(2, 3).ravel()

    def line(density: float, support: str, column: str) -> tuple[list[int], np.ndarray]:
        own = [
            row
            for row in rows
            if (row["density"], row["support"], row["point"]) == (density, support, "centre")
        ]
        return [row["segments"] for row in own], np.array([row[column] for row in own])

    for density, colour in COLOURS.items():
        counts, free = line(density, "free", "restitution [1]")
        _, clamped = line(density, "clamped", "restitution [1]")
        panels[0].plot(counts, free, "o-", color=colour, label=NAMES[density])
        panels[1].plot(counts, 100.0 * (clamped / free - 1.0), "o-", color=colour)
        for support, style in (("hand", "o-"), ("limb", "s--")):
            _, force = line(density, support, "hand_force_z [N]")
            text = {"hand": "in a hand", "limb": "in the limb"}[support]
            panels[2].plot(counts, force, style, color=colour, label=text if density == 0 else None)
        for band, style in (("0-250", "o-"), ("250-1000", "s--")):
            _, value = line(density, "hand", f"handle {band} Hz [m/s^2]")
            text = f"{band.replace('-', ' to ')} Hz" if density == 0 else None
            panels[3].plot(counts, value, style, color=colour, label=text)
        _, wrist = line(density, "limb", "wrist_deviation force [N]")
        panels[4].plot(counts, wrist, "o-", color=colour)
        _, milliseconds = line(density, "hand", "cost [ms]")
        panels[5].plot(counts, milliseconds, "o-", color=colour)
    for axes, title, label in zip(
        panels,
        (
            "Free racket, centre",
            "Handle clamped against free",
            "Peak force on the hand",
            "Handle's acceleration, in a hand",
            "Peak force in the limb's wrist",
            "CPU time of 50 ms in a hand",
        ),
        (
            "apparent restitution",
            "faster rebound (%)",
            "N, along the strings' normal",
            "root mean square (m/s²)",
            "N, beyond that before the impact",
            "ms, compiled engine",
        ),
        strict=True,
    ):
        axes.set_title(title, fontsize=10)
        axes.set_ylabel(label)
        axes.set_xlabel("segments")
        axes.set_xticks([2, 3, 4, 6, 8, 12])
        if axes is panels[5]:
            axes.set_yscale("log")
        else:
            axes.set_ylim(0.0, 1.1 * axes.get_ylim()[1])
        tidy(axes)
    for axes in (panels[0], panels[2], panels[3]):
        axes.legend(frameon=False, fontsize=8)
    figure.suptitle("How many segments does a stroke need? Tour racket, 25 m/s at the centre")
    return figure
