"""Draws the modal analysis: frame modes, string-bed modes, frequencies against the grip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.parameters.racket import RacketParameters
from drake_racket.plots.style import (
    BLUE,
    GREEN,
    GREY,
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

_DEFLECTION = 60.0  # mm, drawn for the largest displacement of the axis
_TITLES = {
    "out_of_plane": "Out of plane, from the side",
    "in_plane": "In plane, from the ball's side",
}


_BODIES = {2: "two"}


def frame_modes_figure(modes: xarray.Dataset, racket: RacketParameters) -> Figure:
    """Draws the bending mode in each plane, exaggerated, with its nodes and antinodes.

    Args:
        modes: of `modes_dataset`.
        racket: for the outline.

    """
    figure = new_figure(9.0, 6.9)
    # one scale along and across in both panels, so that the outline keeps its shape
    panels = figure.subplots(2, 1, sharex=True, height_ratios=[150.0, 290.0])
    for axes, plane in zip(panels, ("out_of_plane", "in_plane"), strict=True):
        joint = modes["strain_share"].sel(element=plane).to_numpy()
        at = int(np.argmax(joint))
        if modes.attrs["segments"] > 2:  # the lowest that bends there
            at = modes["kind"].to_numpy().tolist().index(plane)
        _draw_mode(axes, modes.isel(mode=at), plane, racket)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False, fontsize=8)
    panels[-1].set_xlabel("distance from the butt (mm)")
    strings = "strung" if modes.attrs["strung"] else "bare frame"
    support = modes.attrs["support"].replace("_", " ")
    figure.suptitle(
        f"{as_written(racket.title.split(',')[0])}: bending modes, {strings}, {support}"
    )
    return figure


def _draw_mode(axes: Any, mode: xarray.Dataset, plane: str, racket: RacketParameters) -> None:
    x, count = 1e3 * mode["x"].to_numpy(), int(mode.attrs["segments"])
    bodies = f"{_BODIES.get(count, count)} rigid bodies"
    shape = mode["shape"].sel(direction=plane).to_numpy()
    at_throat = shape[np.argmin(np.abs(x - 1e3 * racket.handle.length.value))]
    # drawn with the throat up, whatever sign the normalisation gave
    scale = _DEFLECTION / np.max(np.abs(shape)) * (-1.0 if at_throat < 0.0 else 1.0)
    if plane == "in_plane":
        draw_outline(axes, racket)
    else:
        axes.plot([x[0], x[-1]], [0.0, 0.0], color="0.6", lw=1.2, zorder=1)
    axes.plot(x, scale * shape, color=BLUE, lw=2, label=bodies)
    axes.plot(x, -scale * shape, color=BLUE, lw=0.8, alpha=0.5, label="half a period later")
    axes.plot(
        x, scale * mode["fit"], color=VERMILION, ls="--", lw=1.2, label="quadratic regression"
    )
    for how, colour, name in (("exact", BLUE, "exact"), ("regression", VERMILION, "regression")):
        nodes = 1e3 * mode[f"node_{how}"].to_numpy()
        axes.plot(nodes, 0.0 * nodes, "o", color=colour, ms=7, zorder=4, label=f"nodes, {name}")
        antinode = 1e3 * float(mode[f"antinode_{how}"])
        curve = shape if how == "exact" else mode["fit"].to_numpy()
        height = scale * float(np.interp(antinode, x, curve))
        axes.plot(antinode, height, "^", color=colour, ms=9, zorder=4, label=f"antinode, {name}")
    published = 1e3 * float(mode["published_antinode"])
    if np.isfinite(published):
        axes.axvline(published, color=GREEN, lw=1.2, ls=":", label="antinode, published")
    text = f"{_TITLES[plane]}: {float(mode['frequency']):.1f} Hz"
    if np.isfinite(mode["published_frequency"]):
        text += f" (published {float(mode['published_frequency']):.0f} Hz)"
    text += f", damping ratio {float(mode['damping_ratio']):.3f}"
    axes.set_title(text, fontsize=10)
    axes.set_ylabel("exaggerated (mm)")
    half = 145.0 if plane == "in_plane" else 75.0
    axes.set(ylim=(-half, half), xlim=(-30.0, x[-1] + 30.0), aspect="equal")
    tidy(axes)


def string_modes_figure(coupling: xarray.Dataset, racket: RacketParameters) -> Figure:
    """Draws the nine string-bed modes with the head clamped, as maps on the outline.

    Args:
        coupling: of `string_bed_coupling`.
        racket: for outline and places of the points.

    """
    figure = new_figure(8.0, 9.0)
    places = 1e3 * np.array([racket.point(i)[:2] for i in racket.bed_topology().points])
    bed, length = racket.string_bed, racket.handle.length.value
    centre = 1e3 * (length + bed.gsc.value)
    half_x, half_y = 1e3 * bed.rim_semi_axis_x.value, 1e3 * bed.rim_semi_axis_y.value
    for i, axes in enumerate(figure.subplots(3, 3).flat):
        mode = coupling.isel(mode=i)
        draw_outline(axes, racket, along_x=False)
        shape = mode["string_shape"].to_numpy()
        marks = axes.scatter(
            -places[:, 1],
            places[:, 0],
            c=shape / np.max(np.abs(shape)),
            cmap="RdBu_r",
            vmin=-1.0,
            vmax=1.0,
            s=340,
            edgecolors="0.3",
            zorder=3,
        )
        axes.set_xlim(-half_y - 15.0, half_y + 15.0)
        axes.set_ylim(centre - half_x - 15.0, centre + half_x + 15.0)
        axes.set_title(
            f"{float(mode['frequency']):.0f} Hz (racket free:"
            f" {float(mode['frequency_free']):.0f} Hz)",
            fontsize=9,
        )
        axes.set(xticks=[-68.5, 0.0, 68.5])
        axes.tick_params(labelsize=7)
        tidy(axes)
    figure.axes[7].set_xlabel("-y, seen from the ball's side (mm)", fontsize=9)
    figure.axes[3].set_ylabel("distance from the butt (mm)", fontsize=9)
    figure.colorbar(
        marks,
        ax=figure.axes,
        location="bottom",
        shrink=0.5,
        label="deflection over the largest (1)",
    )
    figure.suptitle(f"{as_written(racket.title)}: string-bed modes, head clamped")
    return figure


def grip_figure(sweeps: Sequence[xarray.Dataset]) -> Figure:
    """Draws frequencies against the grip's stiffness, one column per plane, with their two limits.

    Args:
        sweeps: of `grip_sweep`, one per racket.

    """
    figure = new_figure(10.0, 5.8)
    panels = figure.subplots(1, 2, sharey=True)
    for axes, plane in zip(panels, ("out_of_plane", "in_plane"), strict=True):
        for sweep in sweeps:
            _draw_sweep(axes, sweep.sel(plane=plane), plane)
        axes.axvline(1.0, color=GREEN, lw=1.2, label="default grip (inferred)")
        axes.set(xscale="log", yscale="log", ylim=(0.5, 2000.0))
        axes.set_title(plane.replace("_", " ").capitalize())
        axes.set_xlabel("stiffness of the grip over the default (1)")
        tidy(axes)
    panels[0].set_ylabel("undamped frequency (Hz)")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    kind = "strung racket" if sweeps[0].attrs["strung"] else "bare frame"
    figure.suptitle(f"{kind.capitalize()} held by spring-dampers to a hand at rest")
    return figure


def _draw_sweep(axes: Any, sweep: xarray.Dataset, plane: str) -> None:
    """Thick where most strain energy is in the throat joint: where the mode is bending."""
    name = sweep.attrs["racket"]
    colour = RACKET_COLOURS.get(name, GREY)
    factor = sweep["factor"].to_numpy()
    for order in sweep["order"].to_numpy():
        frequency = sweep["frequency"].sel(order=order).to_numpy()
        bends = (sweep["kind"].sel(order=order) == plane).to_numpy()
        first = order == 1
        axes.plot(
            factor, frequency, color=colour, lw=1.0, label=f"{name}: rigid motion" * bool(first)
        )
        axes.plot(
            factor,
            np.where(bends, frequency, np.nan),
            color=colour,
            lw=3.5,
            label=f"{name}: bending" * bool(first),
        )
    free = float(sweep["free_frequency"].max())
    clamped = float(sweep["clamped_frequency"].min())
    for limit, style, text in ((free, "--", "free"), (clamped, ":", "handle clamped")):
        axes.axhline(limit, color=colour, ls=style, lw=1.0, label=f"{name}: bending, {text}")
