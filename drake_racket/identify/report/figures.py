"""Pictures of a fit: residuals, correlation, and how the starts converged."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.identify.core.result import FitResult
from drake_racket.plots.style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    new_figure,
    tidy,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">")
_LONG_RMS_RANGE = 20.0  # between highest and lowest RMS: a log axis from here on


def residual_figure(
    result: FitResult,
    labels: Sequence[Any] | None = None,
    *,
    abscissa: NDArray[np.float64] | None = None,
    abscissa_label: str = "measured value",
    scale: float = 1.0,
    unit: str | None = None,
) -> Figure:
    """Draws the residuals over `abscissa`, one marker per label, with the RMS as a band.

    Args:
        labels: (m,) group of each measured value, as its impact point; None: one group.
        abscissa: (m,), as incoming speed; None: the number of the measured value.
        abscissa_label: with its unit, as "incoming speed [m/s]".
        scale: what the residuals are multiplied with, as 100 for per cent.
        unit: theirs after that; None: the result's.

    """
    count = len(result.residuals)
    at = np.arange(1, count + 1, dtype=float) if abscissa is None else np.asarray(abscissa, float)
    groups = np.full(count, "") if labels is None else np.array([str(label) for label in labels])
    unit = result.residual_unit if unit is None else unit
    values, rms = scale * result.residuals, scale * result.rms
    figure = new_figure(7.0, 4.0)
    axes = figure.subplots()
    axes.axhspan(-rms, rms, color="0.92", zorder=0, label=f"RMS {rms:.3g} {unit}".rstrip())
    axes.axhline(0.0, color=GREY, lw=0.8, zorder=1)
    for i, group in enumerate(dict.fromkeys(groups)):  # in the data's order
        chosen = groups == group
        marker, colour = _MARKERS[i % len(_MARKERS)], _COLOURS[i % len(_COLOURS)]
        style: dict[str, Any] = {"marker": marker, "color": colour, "ms": 4.5, "ls": "none"}
        axes.plot(at[chosen], values[chosen], label=group or None, **style)
    axes.set_xlabel(abscissa_label)
    axes.set_ylabel(f"model - measured{_bracket(unit)}")
    axes.set_title(result.title, fontsize="medium")
    tidy(axes)
    figure.legend(loc="outside right upper", frameon=False, fontsize="small")
    return figure


def correlation_figure(result: FitResult) -> Figure:
    """Draws the correlation matrix of the estimates; grey where a parameter is not determined."""
    names, count = result.names, len(result.names)
    side = 1.6 + 0.62 * count
    figure = new_figure(side + 0.9, side)
    axes = figure.subplots()
    matrix = np.ma.masked_invalid(result.correlation)
    from matplotlib import colormaps

    colours = colormaps["PuOr"].with_extremes(bad="0.85")
    image = axes.imshow(matrix, cmap=colours, vmin=-1.0, vmax=1.0)
    for i in range(count):
        for j in range(count):
            value = result.correlation[i, j]
            text = f"{value:.2f}" if np.isfinite(value) else "?"
            colour = "white" if np.isfinite(value) and abs(value) > 0.7 else "black"
            axes.text(j, i, text, ha="center", va="center", color=colour, fontsize="small")
    axes.set_xticks(range(count), names, rotation=45, ha="right")
    axes.set_yticks(range(count), names)
    figure.colorbar(image, ax=axes, label="correlation [1]", shrink=0.85)
    axes.set_title(result.title, fontsize="medium")
    return figure


def starts_figure(result: FitResult, *, scale: float = 1.0, unit: str | None = None) -> Figure:
    """Draws the lowest RMS so far over the evaluations, one line per start; the best one in colour.

    Args:
        scale: what the RMS is multiplied with, as 100 for per cent.
        unit: its unit after that; None: the result's.

    """
    unit = result.residual_unit if unit is None else unit
    figure = new_figure(6.0, 3.8)
    axes = figure.subplots()
    records = [r for r in result.convergence if len(r.history)]
    best = min(records, key=lambda r: (r.cost, r.number))
    for record in sorted(records, key=lambda r: r is best):
        count, rms = record.history.T
        line = np.append(count, record.evaluations), scale * np.append(rms, rms[-1])
        first = record is best
        style: dict[str, Any] = {"color": BLUE if first else "0.65", "lw": 2.0 if first else 1.0}
        axes.step(*line, where="post", **style)
        axes.plot(line[0][-1], line[1][-1], "o" if record.converged else "x", color=style["color"])
    rms = np.concatenate([r.history[:, 1] for r in records])
    if rms.min() > 0.0 and rms.max() > _LONG_RMS_RANGE * rms.min():
        axes.set_yscale("log")
    if max(r.evaluations for r in records) > 1000:
        axes.set_xscale("log")
    axes.set_xlabel("evaluations of the model [1]")
    axes.set_ylabel(f"lowest RMS so far{_bracket(unit)}")
    found = f"{scale * result.rms:.4g} {unit}".rstrip()
    starts = f", {len(records)} starts" if len(records) > 1 else ""
    axes.set_title(f"{result.title}\n{result.method}{starts}: {found}", fontsize="medium")
    tidy(axes)
    return figure


def _bracket(unit: str) -> str:
    return f" [{unit}]" if unit else ""
