"""Sobol indices as points with their confidence intervals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from drake_racket.plots import BLUE, VERMILION, new_figure, tidy

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

_INDICES = (
    ("first_order", "first order: alone", BLUE, "o", -0.13),
    ("total", "total: with others", VERMILION, "s", 0.13),
)


def sensitivity_figure(indices: xarray.Dataset, titles: Mapping[str, str] | None = None) -> Figure:
    """A panel per output, a row per parameter; data from `drake_racket.sweep.sobol_indices`.

    Args:
        titles: output -> title of its panel; the output's name if there is none.

    """
    outputs = [str(x) for x in indices["output"].to_numpy()]
    first = indices["total"].sel(output=outputs[0])
    order = np.argsort(-first.to_numpy())  # what decides most on top
    indices = indices.isel(parameter=order)
    parameters = [str(x) for x in indices["parameter"].to_numpy()]
    figure = new_figure(2.6 + 2.7 * len(outputs), 2.2 + 0.55 * len(parameters))
    panels = figure.subplots(1, len(outputs), sharex=True, sharey=True, squeeze=False)[0]
    places = np.arange(len(parameters))
    for axes, output in zip(panels, outputs, strict=True):
        for name, label, colour, marker, shift in _INDICES:
            at = indices.sel(output=output)
            axes.errorbar(
                at[name],
                places + shift,
                xerr=at[f"{name}_half_width"],
                fmt=marker,
                color=colour,
                ms=5,
                capsize=2.5,
                lw=1.2,
                label=label,
            )
        axes.axvline(0.0, color="0.8", lw=0.8, zorder=0)
        axes.set_xlim(-0.05, 1.0)
        axes.set_title((titles or {}).get(output, output.replace("_", " ")), fontsize=10)
        for place in places[:-1]:
            axes.axhline(place + 0.5, color="0.92", lw=0.8, zorder=0)
        tidy(axes)
    panels[0].set_yticks(places, [_label(indices, name) for name in parameters], fontsize=9)
    panels[0].invert_yaxis()
    confidence = 100.0 * float(indices.attrs["confidence"])
    figure.suptitle("What decides, sorted by its share in ball speed")
    panels[len(panels) // 2].set_xlabel(
        f"share of the variance (bars: {confidence:g} % confidence, cut at 1;"
        f" {indices.attrs['rows']} cases)",
        fontsize=10,
    )
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False, fontsize=9)
    return figure


def _label(indices: xarray.Dataset, name: str) -> str:
    """A parameter and its span."""
    at = indices.sel(parameter=name)
    unit = str(at["unit"].item())
    low, high = float(at["low"]), float(at["high"])
    if unit in ("m", "kg"):
        low, high, unit = 1e3 * low, 1e3 * high, {"m": "mm", "kg": "g"}[unit]
    shown = "times" if unit == "1" else unit
    return f"{name}\n{low:g} to {high:g} {shown}"
