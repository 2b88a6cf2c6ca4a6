"""The figure: ball speed over the swing, racket by racket, for two players."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.plots import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STYLES = tuple(
    zip((BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY), ("o", "s", "D", "^", "v", "P"), strict=True)
)
_PLACES = (("centre [m/s]", "at the centre"), ("60 mm to tip [m/s]", "60 mm towards the tip"))


def swings_figure(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Ball speed over the mean of all rackets, so that differences show; common scales."""
    players = list(dict.fromkeys(row["player"] for row in rows))
    rackets = list(dict.fromkeys(row["racket"] for row in rows))
    rates = sorted({row["rate [rad/s]"] for row in rows})
    figure = new_figure(10.0, 7.0)
    panels = figure.subplots(len(_PLACES), len(players), sharex=True, sharey=True, squeeze=False)
    for axes_row, (column, text) in zip(panels, _PLACES, strict=True):
        for axes, player in zip(axes_row, players, strict=True):
            speed = np.array(
                [
                    [
                        next(
                            row[column]
                            for row in rows
                            if (row["racket"], row["player"], row["rate [rad/s]"])
                            == (racket, player, rate)
                        )
                        for rate in rates
                    ]
                    for racket in rackets
                ]
            )
            for values, name, (colour, mark) in zip(
                speed - speed.mean(axis=0), rackets, _STYLES, strict=False
            ):
                axes.plot(rates, values, color=colour, marker=mark, label=name)
            axes.axhline(0.0, color="0.85", lw=0.8, zorder=0)
            axes.set_title(f"{player}, {text}", fontsize=10)
            tidy(axes)
    for axes in panels[-1]:
        axes.set_xlabel("swing of a racket of 320 kg cm² (rad/s)")
    for axes in panels[:, 0]:
        axes.set_ylabel("ball speed less the mean (m/s)")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize=9)
    figure.suptitle("Ball speed of five rackets against their mean, for two ways to swing")
    return figure
