"""Draws the string-bed of one log at four instants, on the racket's outline."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.laws.bed import rest_lengths
from drake_racket.parameters.racket import RacketParameters
from drake_racket.plots.log.impact import title_of
from drake_racket.plots.style import VERMILION, draw_outline, new_figure
from drake_racket.results.formats import racket_of

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

AFTER = 2e-3  # s from release to the last picture: about one period of the strings' slowest mode


def string_map_figure(history: xarray.Dataset) -> Figure:
    """Draws the deflections of the points and tensions of the springs.

    Half-way to peak force, at peak force, at release, and 2 ms after it; the ball must have
    touched. Tension is
    shown as its change from that of the racket at rest, on one scale for all pictures, spread at
    its lower end (it grows with the square of the deflection).
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize, PowerNorm
    from matplotlib.ticker import MaxNLocator

    racket = racket_of(history)
    instants = snapshots(history)
    rest = racket.string_bed.initial_tension.value
    change = history["string_tension"].to_numpy() - rest
    shown = change[[i for _, i in instants]]
    low, high = float(shown.min()), max(float(shown.max()), 1e-9)
    # only damped strings can pull less than at rest
    spread = PowerNorm(0.5, 0.0, high, clip=True)
    norm = spread if low > -1e-3 * high else Normalize(low, high)
    colours = ScalarMappable(norm, "cividis_r")
    figure = new_figure(3.0 * len(instants) + 1.2, 5.0)
    panels = figure.subplots(1, len(instants), squeeze=False)[0]
    for axes, (name, i) in zip(panels, instants, strict=True):
        sample = history.isel(time=i)
        _draw_bed(axes, racket, sample["string_deflection"].to_numpy(), colours.to_rgba(change[i]))
        point = int(sample["contact_point"])
        across, along = _place(racket, point)
        if sample["in_contact"] > 0.5:
            axes.plot(across, along, "o", ms=25, mfc="none", mec=VERMILION, mew=2.5, zorder=5)
        axes.set_title(
            f"{name}, {1e3 * float(sample['time']):.2f} ms\n"
            f"force {float(sample['normal_force']):.0f} N, tension up to {change[i].max():+.0f} N",
            fontsize=9,
        )
    ticks = MaxNLocator(6).tick_values(norm.vmin or 0.0, high)
    ticks = [t for t in ticks if (norm.vmin or 0.0) <= t <= high]
    bar = figure.colorbar(colours, ax=panels, shrink=0.75, ticks=ticks)
    scale = "square-root scale" if norm is spread else "linear scale"
    bar.set_label(f"tension over the {rest:.0f} N at rest\n(N; {scale})", fontsize=9)
    figure.suptitle(f"{title_of(history)}: string-bed from the ball's side, tip up")
    figure.supxlabel(
        "numbers: deflection (mm), negative away from the ball; ring: point in contact", fontsize=9
    )
    return figure


def snapshots(history: xarray.Dataset) -> list[tuple[str, int]]:
    """Gives names and samples of the pictures of a log with contact.

    Fewer if the log ends earlier.
    """
    time, force = history["time"].to_numpy(), history["normal_force"].to_numpy()
    inside = np.flatnonzero(history["in_contact"].to_numpy())
    last = len(time) - 1
    top = int(np.argmax(force))
    pressed = int(np.searchsorted(time, 0.5 * (time[inside[0]] + time[top])))
    found = [("half-way to peak force", pressed), ("peak force", top)]
    if inside[-1] == last:
        return [*found, ("end of the log, in contact", last)]
    release = int(inside[-1]) + 1
    found.append(("release", release))
    if release < last:
        after = min(int(np.searchsorted(time, time[release] + AFTER)), last)
        found.append(("after", after))
    return found


def spring_ends(racket: RacketParameters) -> NDArray[np.float64]:
    """Gives both ends of the m springs in the string plane of R (m), (m, 2, 2)."""
    bed, topology = racket.string_bed, racket.bed_topology()
    lengths = rest_lengths(
        topology, bed.spacing.value, bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
    )
    first = np.array([racket.point(i + 1)[:2] for i in topology.first])
    return np.stack([first, first + lengths[:, None] * topology.directions], axis=1)


def _place(racket: RacketParameters, point: int) -> tuple[float, float]:
    """Where a point is drawn (mm): across (left is +y), along."""
    x, y, _ = racket.point(point)
    return -1e3 * y, 1e3 * x


def _draw_bed(
    axes: Any, racket: RacketParameters, deflection: NDArray[np.float64], colours: Any
) -> None:
    from matplotlib.collections import LineCollection

    draw_outline(axes, racket, along_x=False)
    ends = spring_ends(racket)
    lines = 1e3 * np.stack([-ends[..., 1], ends[..., 0]], axis=-1)
    axes.add_collection(LineCollection(list(lines), colors=colours, linewidths=4.0, zorder=2))
    for point in racket.bed_topology().points:
        across, along = _place(racket, point)
        axes.plot(across, along, "o", ms=23, mfc="white", mec="0.3", mew=0.8, zorder=3)
        # + 0.0: no -0.0
        text = f"{round(1e3 * float(deflection[point - 1]), 1) + 0.0:.1f}"
        axes.text(across, along, text, ha="center", va="center", fontsize=7, zorder=4)
    length = 1e3 * racket.handle.length.value
    axes.set_ylim(length - 25.0, length + 1e3 * racket.head.length.value + 8.0)
    axes.set_axis_off()
