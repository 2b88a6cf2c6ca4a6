"""The map of kb and cb against what is published."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.plots import BLUE, GREEN, ORANGE, PURPLE, VERMILION, new_figure
from studies.ball_calibration.calibration import nearest, tolerance_needed

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

_LEVELS = (0.0, 0.025, 0.05, 0.075, 0.1, 0.2)


def calibration_figure(dataset: xarray.Dataset) -> Figure:
    """Left: the clamped beds' rebound range. Right: the ball on a rigid plate.

    Args:
        dataset: from `identify.ball_calibration.calibration_dataset`, 2 x 2 places or more.

    """
    figure = new_figure(11.0, 5.6)
    beds, plate = figure.subplots(1, 2, sharex=True, sharey=True)
    kb, cb = 1e-3 * dataset["kb"].to_numpy(), dataset["cb"].to_numpy()
    needed = 100.0 * tolerance_needed(dataset).to_numpy().T
    greys = [str(g) for g in np.linspace(0.62, 0.97, len(_LEVELS) - 1)]
    filled = beds.contourf(kb, cb, needed, [100.0 * v for v in _LEVELS], colors=greys)
    bar = figure.colorbar(filled, ax=beds, shrink=0.85)
    bar.set_label("miss of the rebound range (%)")
    low = dataset["rebound_low"].min("bed").to_numpy().T
    high = dataset["rebound_high"].max("bed").to_numpy().T
    least = dataset["rebound_high"].min("bed").to_numpy().T
    falls = dataset["falls"].min("bed").to_numpy().T
    top = float(dataset.attrs["highest"])
    bottom = float(dataset.attrs["lowest"])
    lines = [
        (low, bottom, BLUE, "-", f"lowest of all beds {bottom:g} m/s"),
        (high, top, VERMILION, "-", f"highest of all beds {top:g} m/s"),
        (least, top, VERMILION, "--", f"highest of the slowest bed {top:g}"),
        (falls, 0.999, PURPLE, ":", "between: restitution falls with speed"),
    ]
    _draw(beds, kb, cb, lines)
    beds.set_title("clamped beds, 18-33 m/s", fontsize="medium")

    force = 1e-3 * dataset["peak_force"].to_numpy().T
    curves = plate.contour(kb, cb, force, np.arange(1.0, 3.0, 0.25), colors="0.45", linewidths=0.9)
    for text in plate.clabel(curves, fmt="%g kN", fontsize=9, colors="0.2", inline_spacing=4):
        text.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0.8})
    longest = 1e3 * dataset["contact_time"].to_numpy().T
    drop = dataset["drop_restitution"].to_numpy().T
    height = float(dataset.attrs["drop_height"])
    ends = [float(np.sqrt(dataset.attrs[k] / height)) for k in ("drop_low", "drop_high")]
    plate.contourf(kb, cb, drop, ends, colors=[ORANGE], alpha=0.45)
    axis = 1e-3 * float(dataset.attrs["peak_force"])
    limit = 1e3 * float(dataset.attrs["contact_time"])
    lines = [
        (force, axis, GREEN, "-", f"peak force at 33 m/s {axis:g} kN: end of the axis"),
        (longest, limit, BLUE, ":", f"contact {limit:g} ms: end of the axis"),
    ]
    _draw(plate, kb, cb, lines)
    plate.fill([], [], color=ORANGE, alpha=0.45, label="ITF drop (7 m/s, outside 18-33 m/s)")
    plate.set_title("rigid plate, closed form", fontsize="medium")
    best = nearest(dataset)
    marks = [
        ("o", dataset.attrs["kb_default"], dataset.attrs["cb_default"], "default"),
        ("^", float(best["kb"]), float(best["cb"]), "nearest to the rebound range"),
    ]
    for axes in (beds, plate):
        for marker, x, y, label in marks:
            style: dict[str, Any] = {"color": "black", "ls": "none", "mec": "white", "ms": 10}
            axes.plot(1e-3 * x, y, marker, label=label, zorder=5, clip_on=False, **style)
        axes.set_xlabel("kb at 18 m/s (kN/m)")
        axes.legend(
            fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.13), frameon=False, ncols=2
        )
    beds.set_ylabel("cb at 18 m/s (N s/m)")
    figure.suptitle("Which kb and cb fit what is published of the ball")
    return figure


def _draw(axes: Any, kb: Any, cb: Any, lines: Any) -> None:
    """Contours with a name each; one that the map does not reach has no name."""
    for values, level, colour, style, label in lines:
        if np.nanmin(values) < level < np.nanmax(values):
            axes.contour(kb, cb, values, [level], colors=colour, linestyles=style, linewidths=1.8)
            axes.plot([], [], color=colour, ls=style, label=label)
