"""Draws the contact force of one log, over time and over the ball's compression."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import trapezoid

from drake_racket.plots.log.impact import draw_contact_force, finish_time_axis, title_of
from drake_racket.plots.style import BLUE, VERMILION, new_figure, tidy

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


def contact_force_figure(history: xarray.Dataset) -> Figure:
    """Draws the force over time with peak and impulse, and over the ball's compression.

    The integral of the normal force over compression, from touch to release, is what the ball's
    damper takes and what its spring still holds when the strings let go: the ball's loss.
    """
    figure = new_figure(9.6, 4.2)
    over_time, loop = figure.subplots(1, 2)
    draw_contact_force(over_time, history)
    finish_time_axis(over_time, history)
    time, force = history["time"].to_numpy(), history["normal_force"].to_numpy()
    top, impulse = int(np.argmax(force)), float(trapezoid(force, time))
    over_time.plot(1e3 * time[top], force[top], "o", color=VERMILION, ms=5)
    over_time.set_title(
        f"peak {force[top]:.0f} N at {1e3 * time[top]:.2f} ms, impulse {impulse:.3f} N s"
    )
    inside = history["in_contact"].to_numpy() > 0.5
    compression = 1e3 * history["compression"].to_numpy()
    loop.plot(np.where(inside, compression, np.nan), force, color=BLUE)
    loop.plot(compression[top], force[top], "o", color=VERMILION, ms=5, label="peak force")
    taken = float(trapezoid(np.where(inside, force, 0.0), 1e-3 * compression))
    loop.set(
        xlabel="compression of the ball (mm)",
        ylabel="normal force (N)",
        title=f"lost in the ball (area below the path): {taken:.2f} J",
    )
    loop.legend(frameon=False, loc="upper left")
    tidy(loop)
    figure.suptitle(f"{title_of(history)}: contact force (shaded: in contact)")
    return figure
