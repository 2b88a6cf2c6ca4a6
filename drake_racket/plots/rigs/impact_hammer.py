"""Strikes with the impact hammer, from their datasets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.plots.style import BLUE, GREY, VERMILION, as_written, new_figure, tidy
from drake_racket.rigs.hammer.ringing import Ringing

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

COLOURS = {"in_plane": VERMILION, "out_of_plane": BLUE}
HIGHEST = 500.0  # Hz, of the spectrum shown


def hammer_figure(
    strikes: Mapping[str, xarray.Dataset],
    ringing: Mapping[str, Ringing],
    published: Mapping[str, float],
    note: str = "",
) -> Figure:
    """Draws pulse, acceleration, its ringing and the ringing's spectrum; one column per direction.

    Args:
        strikes: by direction, as `rigs.hammer_dataset` returns them.
        ringing: by direction, of the acceleration after the pulse.
        published: frequencies (Hz) by direction; NaN where there is none.
        note: a line under the title, such as where the pulse comes from.

    """
    figure: Figure = new_figure(5.0 * len(strikes), 9.0)
    panels = figure.subplots(4, len(strikes), squeeze=False)
    for column, (direction, strike) in enumerate(strikes.items()):
        colour = COLOURS[direction]
        _draw_strike(panels[:3, column], strike, ringing[direction], colour)
        _draw_spectrum(panels[3, column], ringing[direction], published[direction], colour)
        panels[0, column].set_title(direction.replace("_", " "))
    for axes in panels.flat:
        tidy(axes)
    racket = next(iter(strikes.values())).attrs["title"].rsplit(",", 1)[0]
    racket = as_written(racket)
    figure.suptitle(f"{racket}\n{note}" if note else racket)
    return figure


def _draw_strike(panels: Any, strike: xarray.Dataset, ringing: Ringing, colour: str) -> None:
    force, whole, after = panels
    start, end = strike.attrs["pulse_start_s"], strike.attrs["pulse_end_s"]
    time = 1e3 * (strike["time"].to_numpy() - start)
    acceleration = strike["acceleration"].to_numpy()
    near = time <= 3e3 * (end - start)
    force.plot(time[near], strike["force"].to_numpy()[near], color=colour)
    force.set(xlabel="time (ms)", ylabel="hammer force (N)")
    whole.plot(time, acceleration, color=colour, lw=1.0)
    whole.set(xlabel="time (ms)", ylabel="acceleration (m/s²)")
    rings = time >= 1e3 * (end - start)
    after.plot(time[rings], acceleration[rings], color=colour, lw=1.0)
    bound = ringing.amplitude * np.exp(
        -ringing.logarithmic_decrement * ringing.frequency * 1e-3 * (time[rings] - time[rings][0])
    )
    for sign in (1.0, -1.0):
        after.plot(time[rings], sign * bound, color=GREY, lw=0.9, ls="--")
    after.set(xlabel="time (ms)", ylabel="after the pulse (m/s²)")
    text = f"{ringing.frequency:.1f} Hz, damping ratio {100.0 * ringing.damping_ratio:.2f} %"
    after.set_title(text, fontsize="medium", loc="right")


def _draw_spectrum(axes: Any, ringing: Ringing, published: float, colour: str) -> None:
    shown = ringing.lines <= HIGHEST
    label = "after the pulse, Hann window"
    axes.plot(ringing.lines[shown], ringing.spectrum[shown], color=colour, label=label)
    if np.isfinite(published):
        axes.axvline(published, color=GREY, ls="--", lw=0.9, label=f"published {published:g} Hz")
    axes.set(xlabel="frequency (Hz)", ylabel="amplitude (m/s²)", xlim=(0.0, HIGHEST))
    axes.set_ylim(bottom=0.0)
    axes.legend(frameon=False, fontsize="small")
