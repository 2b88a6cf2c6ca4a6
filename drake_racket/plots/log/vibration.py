"""Draws mid-handle acceleration of one log, and the spectrum of its ringing after release."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.interpolate
import scipy.signal
from numpy.typing import NDArray

from drake_racket.plots.log.impact import AXIS_STYLES, draw_vector, finish_time_axis, title_of
from drake_racket.plots.style import BLUE, VERMILION, new_figure, tidy
from drake_racket.results.history import after_release

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

SHORTEST = 0.02  # s: a shorter window cannot tell the frame's modes (resolution 50 Hz)
HIGHEST = 1500.0  # Hz shown: frame and strings are below
_RATE = 50e3  # Hz, of the even samples that the integrator's are turned into
_PADDING = 8  # times the window: lines close enough for a smooth curve
FRAME_BAND = 300.0
"""Hz: the frame's fundamentals are below, the strings' modes above."""
_DECADES = 1e4  # shown below the highest peak
# supports whose frame bends near the frequencies of the free one; a clamp halves them
_LIKE_FREE = ("free", "grip", "limb")


def vibration_figure(history: xarray.Dataset) -> Figure:
    """Draws the acceleration over time.

    Below it the spectrum from release on, if the log is long enough.
    """
    ringing = after_release(history)
    length = float(ringing["time"][-1] - ringing["time"][0]) if ringing.sizes["time"] > 1 else 0.0
    figure = new_figure(9.0, 7.4 if length >= SHORTEST else 4.2)
    panels = figure.subplots(2 if length >= SHORTEST else 1, 1, squeeze=False)[:, 0]
    draw_vector(panels[0], history["handle_acceleration"])
    panels[0].set_ylabel("acceleration (m/s²)")
    finish_time_axis(panels[0], history)
    title = f"{title_of(history)}: mid-handle acceleration, handle axes (shaded: in contact)"
    figure.suptitle(title, fontsize=11)
    if length >= SHORTEST:
        _draw_spectrum(panels[1], history, ringing)
    else:
        panels[0].set_title(
            f"no spectrum: the log ends {1e3 * length:.1f} ms after release, fewer than"
            f" {1e3 * SHORTEST:.0f} ms",
            fontsize=9,
        )
    return figure


def amplitude_spectrum(
    time: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gives the frequencies (Hz) and amplitudes of a signal whose steps are uneven.

    The signal goes through monotone cubics onto even samples; its straight trend is taken away
    (the swing of the racket) and a Hann window laid over it. A steady vibration of amplitude A
    gives a peak of height A; one that decays gives less. The resolution is one over the length.

    Args:
        time: (n,) s, increasing.  values: (n,).

    """
    even = np.arange(time[0], time[-1], 1.0 / _RATE)
    sampled = scipy.interpolate.PchipInterpolator(time, values)(even)
    lines, power = scipy.signal.periodogram(
        sampled,
        _RATE,
        window="hann",
        detrend="linear",
        scaling="spectrum",
        nfft=_PADDING * len(even),
    )
    return lines, np.sqrt(2.0 * power)


def _draw_spectrum(axes: Any, history: xarray.Dataset, ringing: xarray.Dataset) -> None:
    time = ringing["time"].to_numpy()
    increasing = np.append(np.diff(time) > 0.0, True)
    time = time[increasing]
    curves = {}
    for axis, _, _ in AXIS_STYLES:
        values = ringing["handle_acceleration"].sel(axis=axis).to_numpy()[increasing]
        lines, amplitudes = amplitude_spectrum(time, values)
        shown = (lines > 0.0) & (lines <= HIGHEST)
        curves[axis] = lines[shown], amplitudes[shown]
    highest = max(float(amplitudes.max()) for _, amplitudes in curves.values())
    for axis, colour, style in AXIS_STYLES:
        if curves[axis][1].max() > highest / _DECADES:
            axes.semilogy(*curves[axis], color=colour, ls=style, label=axis)
    length = time[-1] - time[0]
    axes.set(
        xlabel="frequency (Hz)",
        ylabel="amplitude (m/s²)",
        xlim=(0.0, HIGHEST),
        title=f"Spectrum of the {1e3 * length:.1f} ms after release: Hann window,"
        f" resolution {1.0 / length:.0f} Hz",
    )
    if highest > 0.0:
        axes.set_ylim(highest / _DECADES, 8.0 * highest)
    _mark_fundamentals(axes, history)
    values = ringing["handle_acceleration"].sel(axis="z").to_numpy()[increasing]
    _note_strings(axes, history, (time, values))
    axes.legend(frameon=False, fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=5)
    tidy(axes)


def _note_strings(axes: Any, history: xarray.Dataset, signal: Any) -> None:
    """Says how much of the ringing along z is the frame's, and where the strings' is largest.

    Args:
        signal: (time, acceleration along z), of the ringing.

    """
    lines, amplitudes = amplitude_spectrum(*signal)
    power = amplitudes**2
    whole, below = float(power.sum()), float(power[lines <= FRAME_BAND].sum())
    if whole <= 0.0:
        return
    share = 100.0 * (below / whole) ** 0.5
    text = f"along z below {FRAME_BAND:.0f} Hz, the frame's band: {share:.0f} % of the RMS"
    top = float(lines[int(np.argmax(amplitudes))])
    if top > FRAME_BAND and _undamped(history):
        text += f"\nundamped strings dominate near {top:.0f} Hz"
    axes.text(
        0.99, 0.98, text, transform=axes.transAxes, ha="right", va="top", fontsize=8, color="0.3"
    )


def _undamped(history: xarray.Dataset) -> bool:
    racket = json.loads(history.attrs.get("racket", "{}"))
    return bool(racket.get("string_bed", {}).get("damping", {}).get("value") == 0.0)


def _mark_fundamentals(axes: Any, history: xarray.Dataset) -> None:
    """Lines at the free frame's fundamentals, where they are the held racket's too."""
    if "scenario" not in history.attrs or "frame_in_plane_hz" not in history.attrs:
        return
    if json.loads(history.attrs["scenario"]).get("support") not in _LIKE_FREE:
        return
    for plane, colour in (("out_of_plane", BLUE), ("in_plane", VERMILION)):
        frequency = float(history.attrs[f"frame_{plane}_hz"])
        label = f"free frame, {plane.replace('_', ' ')}: {frequency:.1f} Hz"
        axes.axvline(frequency, color=colour, lw=1.0, ls=(0, (6, 3)), zorder=0, label=label)
