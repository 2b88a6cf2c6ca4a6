"""Strikes with the impact hammer and the racket fitted to them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from drake_racket.plots.rigs.impact_hammer import COLOURS
from drake_racket.plots.style import GREY, new_figure, tidy

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


def frame_fit_figure(fits: Mapping[str, xarray.Dataset], title: str = "") -> Figure:
    """Draws hammer and acceleration, the ringing with its fit, and what the fit leaves.

    Args:
        fits: by direction, as `FrameFit.to_dataset` returns them; the first strike is drawn.

    """
    figure: Figure = new_figure(5.0 * len(fits), 8.5)
    panels = figure.subplots(4, len(fits), squeeze=False)
    for (hit, early, ringing, left), (direction, fit) in zip(panels.T, fits.items(), strict=True):
        colour = COLOURS[direction]
        strike = fit.isel(strike=0).dropna("time")
        time = 1e3 * strike["time"].to_numpy()
        start = 1e3 * float(strike["fitted_from"])
        measured, model = strike["acceleration"].to_numpy(), strike["model"].to_numpy()
        near, after = time <= 1.5 * start, time >= start
        hit.plot(time[near], strike["force"].to_numpy()[near], color=colour)
        hit.set(xlabel="time (ms)", ylabel="hammer force (N)")
        hit.set_title(
            f"{direction.replace('_', ' ')}, {1e3 * fit.attrs['place_m']:.0f} mm from the butt"
        )
        for axes, shown in ((early, near), (ringing, after)):
            dots = {"ms": 2.5, "color": GREY, "label": "measured"}
            axes.plot(time[shown], measured[shown], ".", **dots)
            axes.plot(time[shown], model[shown], color=colour, lw=1.2, label="fitted model")
            axes.axvline(start, color=GREY, lw=0.8, ls=":")
        early.set(xlabel="time (ms)", ylabel="acceleration (m/s²)")
        early.legend(frameon=False, fontsize="small")
        ringing.set(xlabel="time (ms)", ylabel="after the pulse (m/s²)")
        ringing.set_title(_summary(fit), fontsize="small")
        left.plot(time[after], (model - measured)[after], color=colour, lw=0.7)
        left.axhline(0.0, color=GREY, lw=0.8)
        left.set(xlabel="time (ms)", ylabel="fitted less measured (m/s²)")
        rms, share = fit.attrs["rms_m_per_s2"], 100.0 * fit.attrs["relative_rms"]
        left.set_title(f"RMS {rms:.3g} m/s², {share:.2g} % of the ringing's", fontsize="small")
    for axes in np.ravel(panels):
        tidy(axes)
    if title:
        figure.suptitle(title)
    return figure


def _summary(fit: xarray.Dataset) -> str:
    units = {"kf": "N*m/rad", "cf": "N*m*s/rad", "frequency": "Hz"}
    found = {
        name: (fit.attrs[f"{name} [{unit}]"], fit.attrs[f"{name}_standard_error [{unit}]"])
        for name, unit in units.items()
    }
    (kf, kf_error), (cf, cf_error), (f, f_error) = found.values()
    return (
        f"kf {kf:.6g} ± {kf_error:.2g} N m/rad, cf {cf:.4g} ± {cf_error:.2g} N m s/rad\n"
        f"{f:.5g} ± {f_error:.2g} Hz (± standard error)"
    )
