"""How often the fits' intervals contain the truth, as a figure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from drake_racket.plots import GREY, VERMILION, new_figure, tidy

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


def coverage_figure(parts: Mapping[str, xarray.Dataset]) -> Figure:
    """Share of repeats whose 95 % interval contains the true value, and what chance allows.

    Args:
        parts: by title, as `recovery.repeat` gives them. Where more than a tenth of the intervals
            do not determine the parameter the mark is hollow.

    """
    from scipy import stats

    names = [(title, str(n)) for title, d in parts.items() for n in d["parameter"].to_numpy()]
    figure = new_figure(6.6, 0.26 * len(names) + 1.2)
    axes = figure.subplots()
    row = 0
    for data in parts.values():
        count = data.sizes["repeat"]
        inside = (data["lower"] <= data["true_value"]) & (data["true_value"] <= data["upper"])
        low, high = stats.binom.interval(0.99, count, 0.95)
        for i in range(data.sizes["parameter"]):
            share = float(inside.isel(parameter=i).mean())
            firm = float(data["determined"].isel(parameter=i).mean()) >= 0.9
            axes.plot([100.0 * low / count, 100.0 * high / count], [row, row], color="0.8", lw=5)
            fill = VERMILION if firm else "white"
            axes.plot(100.0 * share, row, "o", color=VERMILION, mfc=fill, ms=6)
            row += 1
    axes.axvline(95.0, color=GREY, lw=0.9, ls="--", zorder=0)
    axes.set_yticks(range(len(names)), [f"{title}: {name}" for title, name in names])
    axes.invert_yaxis()
    axes.set_xlabel("95 % intervals that contain the true value (%)")
    axes.plot([], [], color="0.8", lw=5, label="99 % of outcomes by chance at 95 %")
    axes.plot([], [], "o", color=VERMILION, label="determined")
    axes.plot([], [], "o", color=VERMILION, mfc="white", label="not determined")
    figure.legend(loc="outside lower center", ncols=3, frameon=False, fontsize="small")
    tidy(axes)
    return figure
