"""Draws impacts on the force plate, from their dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.io.signals import Signal
from drake_racket.plots.style import BLUE, GREY, VERMILION, as_written, new_figure, tidy

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


def force_plate_figure(data: xarray.Dataset, measured: Signal | None = None) -> Figure:
    """Draws the force over time at every speed, and what is read from it over speed.

    Args:
        data: as `rigs.plate_dataset` returns it.
        measured: a force (N) to draw with it, its time counted from touch.

    """
    figure: Figure = new_figure(10.0, 6.2)
    grid = figure.add_gridspec(3, 3)
    _draw_forces(figure.add_subplot(grid[:, :2]), data, measured)
    panels = (
        ("peak_force", 1.0, "peak force (N)"),
        ("contact_time", 1e3, "contact time (ms)"),
        ("restitution", 1.0, "restitution"),
    )
    shared: Any = None
    for row, (name, scale, label) in enumerate(panels):
        axes = figure.add_subplot(grid[row, 2], sharex=shared)
        shared = axes
        _draw_over_speed(axes, data, name, scale)
        axes.set_ylabel(label)
        axes.tick_params(labelbottom=row == 2)
    shared.set_xlabel("approach speed (m/s)")
    figure.suptitle(f"{as_written(data.attrs['title'])}: model, and its closed form")
    return figure


def _draw_forces(axes: Any, data: xarray.Dataset, measured: Signal | None) -> None:
    from matplotlib import colormaps

    time = 1e3 * data["time"].to_numpy()
    count = data.sizes["speed"]
    colours = colormaps["viridis"](np.linspace(0.0, 0.85, count))
    for i, colour in enumerate(colours):
        case = data.isel(speed=i)
        label = f"{float(case['speed']):g} m/s"
        axes.plot(time, case["force"], color=colour, lw=1.8, label=label)
        last = "closed form" if i == count - 1 else None
        axes.plot(
            time, case["force_closed_form"], color="black", lw=0.9, ls=(0, (2, 3)), label=last
        )
    if measured is not None:
        style = {"color": VERMILION, "lw": 1.2, "label": f"{measured.where.rsplit('/')[-1]}"}
        axes.plot(1e3 * measured.time, measured.value, **style)
    axes.set(xlabel="time from touch (ms)", ylabel="force on the plate (N)", xlim=(-0.5, 5.0))
    axes.legend(frameon=False)
    tidy(axes)


def _draw_over_speed(axes: Any, data: xarray.Dataset, name: str, scale: float) -> None:
    """The model at each speed; dotted lines where the ball's identified speeds end."""
    speed = data["speed"].to_numpy()
    form = scale * data[f"{name}_closed_form"].to_numpy()
    axes.plot(speed, scale * data[name].to_numpy(), "o", color=BLUE, label="model")
    axes.plot(speed, form, "k+", ms=9, mew=0.9, label="closed form")
    axes.legend(frameon=False, fontsize="small")
    low, high = data.attrs["identified_speeds_m_per_s"]
    for edge, outside in ((low, speed.min() < low), (high, speed.max() > high)):
        if outside:  # the ball's constants are held beyond it
            axes.axvline(edge, color=GREY, lw=0.8, ls=":")
    tidy(axes)
