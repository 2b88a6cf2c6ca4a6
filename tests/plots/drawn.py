"""What a figure draws, as plain data: for a record, or to be compared with what it was made of."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.collections import Collection, LineCollection, PathCollection, PolyCollection
from matplotlib.colors import to_hex
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from tests.recorded import summary


def drawn(figure: Figure) -> dict[str, Any]:
    """Size, title, and by axes every text, curve, marker and bar with its numbers."""
    found: dict[str, Any] = {"inches": list(figure.get_size_inches())}
    for name, text in (
        ("title", figure.get_suptitle()),
        ("below", figure.get_supxlabel()),
    ):
        if text:
            found[name] = text
    found["legends"] = [[t.get_text() for t in one.get_texts()] for one in figure.legends]
    found["axes"] = [_axes(one) for one in figure.axes]
    return found


def _axes(axes: Any) -> dict[str, Any]:
    found: dict[str, Any] = {
        "title": axes.get_title() or axes.get_title(loc="right"),
        "x": [axes.get_xlabel(), axes.get_xscale(), *map(float, axes.get_xlim())],
        "y": [axes.get_ylabel(), axes.get_yscale(), *map(float, axes.get_ylim())],
        "on": bool(axes.axison),
        "aspect": str(axes.get_aspect()),
    }
    if axes.axison:
        found["ticks"] = [_ticks(axes.xaxis), _ticks(axes.yaxis)]
        found["spines"] = [name for name, s in axes.spines.items() if s.get_visible()]
    legend = axes.get_legend()
    if legend is not None:
        found["legend"] = [t.get_text() for t in legend.get_texts()]
    found["lines"] = [_line(one) for one in axes.lines]
    found["marks"] = [_collection(one) for one in axes.collections]
    found["bars"] = [_patch(one) for one in axes.patches]
    found["texts"] = [
        [t.get_text(), str(t.get_color()), *map(float, getattr(t, "xy", t.get_position()))]
        for t in axes.texts
    ]
    bars = [c for c in axes.containers if isinstance(c, ErrorbarContainer)]
    found["errors"] = [[c.has_xerr, c.has_yerr] for c in bars]
    return {key: value for key, value in found.items() if value or value is False}


def _ticks(axis: Any) -> Any:
    """Places and words of ticks that were set; what matplotlib chooses is its own."""
    from matplotlib.ticker import FixedLocator

    if not isinstance(axis.get_major_locator(), FixedLocator):
        return "own"
    labels = [t.get_text() for t in axis.get_ticklabels()]
    return [summary(axis.get_majorticklocs()), labels]


def _line(line: Line2D) -> list[Any]:
    label = str(line.get_label())
    x, y = (np.asarray(v, dtype=float) for v in line.get_data())
    colour = to_hex(line.get_color())
    return [
        "" if label.startswith("_") else label,
        f"{colour} {line.get_linestyle()} {line.get_marker()} {line.get_fillstyle()}"
        f" {line.get_linewidth():g} {line.get_markersize():g}",
        summary(x),
        summary(y),
        [float(np.nansum(x * y)), float(np.nansum(np.abs(x * y)))],
    ]


def _collection(one: Collection) -> list[Any]:
    if isinstance(one, LineCollection):
        ends = np.array([np.asarray(s)[[0, -1]] for s in one.get_segments()]).reshape(-1, 4)
        colours = np.asarray(one.get_color(), dtype=float)
        return [
            "lines",
            *(summary(c) for c in ends.T),
            summary(colours),
            *map(float, one.get_linewidths()[:1]),
        ]
    if isinstance(one, PathCollection):
        places = np.asarray(one.get_offsets(), dtype=float)
        known = one.get_array()
        return [
            "points",
            *(summary(c) for c in places.T),
            [] if known is None else summary(known),
            list(one.get_clim()),
            one.get_cmap().name,
        ]
    if isinstance(one, PolyCollection):
        corners = np.concatenate([p.vertices for p in one.get_paths()] or [np.zeros((0, 2))])
        return ["area", *(summary(c) for c in corners.T)]
    return [type(one).__name__]


def _patch(patch: Patch) -> list[Any]:
    corners = patch.get_transform().transform(patch.get_path().vertices)
    data = patch.axes.transData.inverted().transform(corners) if patch.axes else corners
    return [to_hex(patch.get_facecolor()), *(summary(c) for c in np.asarray(data).T)]
