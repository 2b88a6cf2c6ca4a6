"""Draws restitution over the string-bed: clamped head, oblique, moving racket."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.parameters.racket import load_racket
from drake_racket.plots.style import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    RACKET_COLOURS,
    VERMILION,
    as_written,
    draw_outline,
    new_figure,
    tidy,
)

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

_PLACES = {
    "centre (5)": ((5,), BLUE),
    "tip edge (2)": ((2,), VERMILION),
    "throat edge (8)": ((8,), GREEN),
    "side edges (4, 6)": ((4, 6), ORANGE),
    "corners (1, 3, 7, 9)": ((1, 3, 7, 9), PURPLE),
}


def restitution_over_speed(dataset: xarray.Dataset) -> Figure:
    """Draws restitution over approach speed, a panel per bed; data from `rigs.head_clamped`."""
    beds = [(r, t) for r in dataset["racket"].to_numpy() for t in dataset["tension"].to_numpy()]
    rows = (len(beds) + 1) // 2
    figure = new_figure(9.0, 1.0 + 3.0 * rows)
    panels = figure.subplots(rows, 2, sharex=True, sharey=True, squeeze=False)
    for axes, (racket, tension) in zip(panels.flat, beds, strict=False):
        bed = dataset["restitution"].sel(racket=racket, tension=tension)
        for label, (points, colour) in _PLACES.items():
            known = [p for p in points if p in dataset["point"].to_numpy()]
            for n, point in enumerate(known):
                axes.plot(
                    dataset["speed"],
                    bed.sel(point=point),
                    color=colour,
                    marker="o",
                    ms=3,
                    label=label if n == 0 else None,
                )
        axes.set_title(f"{as_written(racket)}, {tension} tension")
        tidy(axes)
    for axes in panels.flat[len(beds) :]:
        axes.set_axis_off()
    panels[0, 0].legend(frameon=False, fontsize=8)
    for axes in panels[-1]:
        axes.set_xlabel("approach speed (m/s)")
    for axes in panels[:, 0]:
        axes.set_ylabel("restitution")
    figure.suptitle("Head clamped, normal impacts")
    return figure


def bed_maps(dataset: xarray.Dataset, name: str, *, scale: float = 1.0, title: str = "") -> Figure:
    """Draws a variable over (racket, another dimension, point) as numbers on the racket's outline.

    Args:
        name: the variable.  scale: factor for the picture.

    """
    values = dataset[name] * scale
    other = next(d for d in map(str, values.dims) if d not in ("racket", "point"))
    rackets, labels = dataset["racket"].to_numpy(), dataset[other].to_numpy()
    figure = new_figure(2.6 * len(labels) + 1.3, 3.6 * len(rackets) + 0.4)
    panels = figure.subplots(len(rackets), len(labels), squeeze=False)
    low, high = float(values.min()), float(values.max())
    for racket_name, row in zip(rackets, panels, strict=True):
        racket = load_racket(str(racket_name))
        for label, axes in zip(labels, row, strict=True):
            drawn = values.sel({"racket": racket_name, other: label})
            dots = _draw_points(axes, racket, drawn, (low, high))
            axes.set_title(
                f"{as_written(racket_name)}, {str(label).replace('_', ' ')}", fontsize=10
            )
    bar = figure.colorbar(dots, ax=panels, shrink=0.6)
    units = dataset[name].attrs["units"]
    bar.set_label(name.replace("_", " ") + ("" if units == "1" else f" ({_unit(units, scale)})"))
    figure.suptitle(title or as_written(dataset.attrs.get("title", "")))
    return figure


def _unit(units: str, scale: float) -> str:
    names = {("m", 1e3): "mm", ("J", 1e3): "mJ", ("N/m", 1e-3): "kN/m", ("m/s^2", 1.0): "m/s²"}
    return names.get((units, scale), units)


def _draw_points(axes: Any, racket: Any, values: xarray.DataArray, limits: Any) -> Any:
    draw_outline(axes, racket, along_x=False)
    places = np.array([racket.point(int(p)) for p in values["point"].to_numpy()])
    across, along = -1e3 * places[:, 1], 1e3 * places[:, 0]
    numbers = values.to_numpy()
    low, high = limits
    dots = axes.scatter(
        across, along, c=numbers, s=620, cmap="cividis", vmin=low, vmax=high, zorder=2
    )
    for x, y, number in zip(across, along, numbers, strict=True):
        dark = number < low + 0.5 * (high - low)
        text = f"{number:.0f}" if abs(number) >= 100.0 else f"{number:.3g}"
        colour = "white" if dark else "black"
        axes.text(x, y, text, ha="center", va="center", color=colour, fontsize=7.5, zorder=3)
    length = 1e3 * racket.handle.length.value
    axes.set_ylim(length - 25.0, length + 1e3 * racket.head.length.value + 5.0)
    axes.set_axis_off()
    return dots


def oblique_figure(dataset: xarray.Dataset, racket: str, tension: str) -> Figure:
    """Draws rebound angle and tangential velocity by point, for all readings."""
    readings = list(dataset["angle_reading"].to_numpy())
    bed = dataset.sel(racket=racket, tension=tension)
    figure = new_figure(4.6 * len(readings), 6.4)
    panels = figure.subplots(2, len(readings), sharex=True, squeeze=False)
    markers = {"velocity": ("o", "full"), "displacement": ("s", "none")}
    colours = dict(zip(dataset["stroke"].to_numpy(), (BLUE, VERMILION), strict=False))
    for column, reading in enumerate(readings):
        for stroke, colour in colours.items():
            for friction in dataset["friction_reading"].to_numpy():
                case = bed.sel(angle_reading=reading, stroke=stroke, friction_reading=friction)
                marker, fill = markers[friction]
                style = {"color": colour, "marker": marker, "fillstyle": fill, "ls": "none"}
                label = f"{stroke.replace('_', ' ')}, friction by {friction}"
                angle = np.degrees(case["rebound_angle"])
                panels[0, column].plot(case["point"], angle, label=label, **style)
                panels[1, column].plot(case["point"], case["tangential_velocity"], **style)
        panels[0, column].set_title(f"angle read {reading.replace('_', ' ')}")
        panels[1, column].set_xlabel("string-bed point")
        panels[1, column].set_xticks(dataset["point"].to_numpy())
        for axes in panels[:, column]:
            axes.axhline(0.0, color="0.8", lw=0.8, zorder=0)
            tidy(axes)
    panels[0, 0].set_ylabel("rebound angle (deg)")
    panels[1, 0].set_ylabel("tangential rebound velocity (m/s)")
    panels[0, -1].legend(frameon=False, fontsize=8, loc="center")
    figure.suptitle(f"Head clamped, oblique impacts: {as_written(racket)}, {tension} tension")
    return figure


def along_axis_figure(dataset: xarray.Dataset, nodes: dict[str, float] | None = None) -> Figure:
    """Draws restitution, bending and mid-handle ringing along the free racket's long axis.

    Args:
        nodes: racket -> the head's node of out-of-plane bending, from the butt (m); drawn if given.

    """
    figure = new_figure(8.0, 7.2)
    panels = figure.subplots(3, 1, sharex=True)
    shown = (
        ("restitution", 1.0, "apparent restitution"),
        ("bending_angle", 180.0 / np.pi, "largest bending angle\nafter release (deg)"),
        ("handle_ringing", 1.0, "RMS mid-handle acceleration\nafter release (m/s²)"),
    )
    for racket in dataset["racket"].to_numpy():
        parameters = load_racket(str(racket))
        centre = parameters.point(5)[0]
        colour = RACKET_COLOURS.get(str(racket), "0.2")
        for axes, (name, scale, text) in zip(panels, shown, strict=True):
            values = scale * dataset[name].sel(racket=racket)
            x = 1e3 * dataset["offset_x"]
            axes.plot(x, values, color=colour, marker="o", ms=3, label=as_written(racket))
            if nodes and name == "bending_angle":
                at = 1e3 * (nodes[str(racket)] - centre)
                axes.axvline(
                    at, color=colour, ls=":", label=f"node of bending, {as_written(racket)}"
                )
            axes.set_ylabel(text)
            tidy(axes)
    for axes in panels[:2]:
        axes.legend(frameon=False, fontsize=8)
    panels[-1].set_xlabel("aim on the long axis, from the string-bed centre towards the tip (mm)")
    figure.suptitle("Free racket struck along its axis at 25 m/s")
    return figure
