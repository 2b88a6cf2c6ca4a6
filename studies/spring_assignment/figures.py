"""The ranking of the spring assignments."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.plots import BLUE, GREY, ORANGE, SKY, VERMILION, new_figure, tidy
from studies.spring_assignment.ranking import shares

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

BEST = 50


def assignment_figure(ranking: xarray.Dataset, firm: xarray.Dataset) -> Figure:
    """Spread of all assignments, against the rim's geometry, what the best share, and settings.

    Args:
        ranking, firm: of `identify.spring_assignment_ranking`'s `rank_all` and `firmness`.

    """
    figure = new_figure(11.0, 8.6)
    layout: Any = [["all", "geometry"], ["k", "p"], ["settings", "settings"]]
    panels = figure.subplot_mosaic(layout, height_ratios=[1.0, 0.95, 1.0])
    _draw_all(panels["all"], ranking)
    _draw_geometry(panels["geometry"], ranking)
    best = min(BEST, ranking.sizes["assignment"])
    by_k, by_p = shares(ranking, best)
    _draw_shares(panels["k"], by_k, list(ranking["line"].to_numpy()), "k")
    _draw_shares(panels["p"], by_p, list(ranking["rim"].to_numpy()), "p")
    panels["k"].set_title(f"k of the lines: % of the best {best}", fontsize=10)
    panels["p"].set_title(f"p of the rim springs: % of the best {best}", fontsize=10)
    _draw_settings(panels["settings"], firm)
    figure.suptitle("Which spring has which k and p: spread of restitution over the nine points")
    return figure


def _draw_all(axes: Any, ranking: xarray.Dataset) -> None:
    spread = ranking["spread"].to_numpy()
    bins = np.linspace(0.0, float(spread.max()), 61)
    groupings = list(dict.fromkeys(ranking["grouping"].to_numpy().tolist()))
    some = [spread[ranking["grouping"].to_numpy() == name] for name in groupings]
    axes.hist(some, bins, stacked=True, color=[BLUE, SKY, GREY][: len(some)], label=groupings)
    shipped = spread[ranking["shipped"].to_numpy()]
    for value in shipped:
        axes.axvline(value, color=VERMILION, lw=1.5, label="as shipped")
    axes.set_xlabel("spread of restitution (standard deviation, mean of four beds)")
    axes.set_ylabel("assignments")
    axes.set_title("all assignments, mirror images once", fontsize=10)
    axes.set_xlim(0.0, 1.45 * float(spread.max()))  # room for the legend
    axes.legend(frameon=False, fontsize=8, loc="upper right")
    tidy(axes)


def _draw_geometry(axes: Any, ranking: xarray.Dataset) -> None:
    spread, misfit = ranking["spread"].to_numpy(), ranking["geometry_misfit"].to_numpy()
    axes.plot(misfit, spread, ".", ms=1.5, color=GREY, alpha=0.5, rasterized=True)
    shipped = ranking["shipped"].to_numpy()
    axes.plot(misfit[shipped], spread[shipped], "o", color=VERMILION, label="as shipped")
    nearest = int(np.argmin(misfit))
    axes.plot(
        misfit[nearest], spread[nearest], "s", color=ORANGE, label="nearest the rim's geometry"
    )
    axes.set_xlabel("RMS of ln(p / p that the springs' lengths give)")
    axes.set_ylabel("spread of restitution")
    axes.set_ylim(0.0, None)
    axes.set_title("uniform restitution against the rim's geometry", fontsize=10)
    axes.legend(frameon=False, fontsize=8)
    tidy(axes)


def _draw_shares(axes: Any, share: Any, names: list[str], letter: str) -> None:
    axes.imshow(100.0 * share, cmap="cividis", vmin=0.0, vmax=100.0, aspect="auto")
    for row, column in np.ndindex(*share.shape):
        value = 100.0 * share[row, column]
        colour = "white" if value < 55.0 else "black"
        axes.text(column, row, f"{value:.0f}", ha="center", va="center", color=colour, fontsize=8)
    axes.set_xticks(range(share.shape[1]), [f"{letter}{i + 1}" for i in range(share.shape[1])])
    axes.set_yticks(range(len(names)), names)
    axes.tick_params(length=0)


def _draw_settings(axes: Any, firm: xarray.Dataset) -> None:
    names = list(firm["setting"].to_numpy())
    y = np.arange(len(names))[::-1]
    axes.plot(firm["least_spread"], y, "|", ms=11, mew=2, color=BLUE, label="best of the shortlist")
    axes.plot(
        firm["shipped_spread"], y, "o", ms=5, color=VERMILION, label="as shipped, with its rank"
    )
    for at, rank, value in zip(y, firm["shipped_rank"], firm["shipped_spread"], strict=True):
        text = f"{int(rank)}"
        axes.annotate(text, (float(value), at), (7, -3), textcoords="offset points", fontsize=8)
    axes.set_yticks(y, names)
    axes.set_ylim(-0.6, len(names) - 0.4)
    axes.set_xlim(0.0, 1.25 * float(firm["shipped_spread"].max()))
    axes.set_xlabel("spread of restitution, mean of four beds and of 18, 25 and 33 m/s")
    axes.set_title("with other choices of what the source does not print", fontsize=10)
    axes.legend(frameon=False, fontsize=8, loc="lower left")
    tidy(axes)
