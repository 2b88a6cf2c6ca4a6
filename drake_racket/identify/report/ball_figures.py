"""Draws the ball's fitted stiffness and damping, and the forces they come from."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.plots.style import BLUE, GREY, VERMILION, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from drake_racket.identify.ball.by_speed import SpeedFit
    from drake_racket.identify.ball.fit import BallFit
    from drake_racket.identify.ball.speed_line import SpeedLine

DARKEST, LIGHTEST = 1.0, 0.45  # share of the colour, fastest to slowest


def ball_fit_figure(fit: BallFit, title: str = "") -> Figure:
    """Draws the force and fit at each speed, what the fit leaves, and kb and cb over speed."""
    figure: Figure = new_figure(10.0, 7.5)
    (force, left), (stiffness, damping) = figure.subplots(2, 2)
    shades = np.linspace(DARKEST, LIGHTEST, len(fit.groups))[::-1]  # one alone is dark
    for group, shade in zip(fit.groups, shades, strict=True):
        _draw_impact(force, left, group, _mixed(BLUE, float(shade)))
    force.plot([], [], ".", color=GREY, ms=4, label="measured")
    force.plot([], [], color=GREY, lw=1.4, label="fitted law")
    force.set(xlabel="time from touch (ms)", ylabel="force on the plate (N)")
    force.legend(frameon=False, fontsize="small", title="first impact at each speed")
    left.axhline(0.0, color=GREY, lw=0.8)
    left.set(xlabel="time from touch (ms)", ylabel="fitted less measured force (N)")
    left.set_title(f"RMS {fit.rms:.3g} N over all impacts", fontsize="medium", loc="right")
    _draw_line(stiffness, fit, 0, fit.stiffness, "stiffness kb (kN/m)", 1e-3)
    _draw_line(damping, fit, 1, fit.damping, "damping cb (N s/m)", 1.0)
    for axes in figure.axes:
        tidy(axes)
    if title:
        figure.suptitle(title)
    return figure


def _draw_impact(force: Any, left: Any, group: SpeedFit, colour: Any) -> None:
    impact, touch, form = group.impacts[0], group.touches[0], group.closed_forms[0]
    time = impact.force.time - touch
    near = (time > -0.2 * form.contact_time) & (time < 1.3 * form.contact_time)
    fine = np.linspace(-0.2, 1.3, 400) * form.contact_time
    force.plot(1e3 * time[near], impact.force.value[near], ".", color=colour, ms=2.5, alpha=0.7)
    force.plot(1e3 * fine, form.force(fine), color=colour, lw=1.4)
    top = form.peak_time, form.peak_force
    force.annotate(
        f"{group.speed:.3g} m/s",
        (1e3 * top[0], top[1]),
        xytext=(0, 5),
        textcoords="offset points",
        ha="center",
        fontsize="small",
    )
    samples = group.contacts[0].samples
    residuals = group.residuals[: samples.stop - samples.start]
    left.plot(1e3 * time[samples], residuals, color=colour, lw=0.8)


def _draw_line(
    axes: Any, fit: BallFit, column: int, line: SpeedLine | None, label: str, scale: float
) -> None:
    speeds = np.array([group.speed for group in fit.groups])
    values = scale * np.array([(group.kb, group.cb)[column] for group in fit.groups])
    intervals = np.array([g.result.confidence_intervals[column] for g in fit.groups])
    reach = np.abs(scale * intervals.T - values)
    reach[~np.isfinite(reach)] = 0.0  # not determined: no bar
    axes.errorbar(
        speeds, values, yerr=reach, fmt="o", color=BLUE, capsize=3, ms=4, label="fit, 95 %"
    )
    if line is not None:
        over = np.linspace(min(fit.speed_low, speeds[0]), max(fit.speed_high, speeds[-1]), 60)
        at = [line.at(float(v)) for v in over]
        axes.plot(over, [scale * e.value for e in at], color=VERMILION, label="line")
        low, high = scale * np.array([e.interval for e in at]).T
        axes.fill_between(over, low, high, color=VERMILION, alpha=0.18, lw=0.0, label="its 95 %")
        growth = line.growth(fit.speed_low, fit.speed_high)
        text = (
            f"{100.0 * growth.value:+.1f} ± {100.0 * growth.standard_error:.1f} % "
            f"(standard error) over {fit.speed_low:.3g} to {fit.speed_high:.3g} m/s"
        )
        axes.set_title(text, fontsize="medium", loc="right")
    axes.set(xlabel="approach speed (m/s)", ylabel=label)
    axes.legend(frameon=False, fontsize="small", loc="upper left")


def _mixed(colour: str, share: float) -> NDArray[np.float64]:
    """`colour` on white."""
    from matplotlib.colors import to_rgb

    return np.asarray(share * np.array(to_rgb(colour)) + (1.0 - share))
