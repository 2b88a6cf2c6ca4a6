"""Draws the inertia bench, from its dataset and one swing's history."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

from drake_racket.plots.style import (
    BLUE,
    GREEN,
    GREY,
    PURPLE,
    RACKET_COLOURS,
    VERMILION,
    as_written,
    new_figure,
    tidy,
)

_MARKERS = {"longitudinal": "s", "transverse": "o", "frontal": "^"}
_AXES = {"longitudinal": "x, longitudinal", "transverse": "y, transverse", "frontal": "z, frontal"}


def inertia_bench_figure(bench: xarray.Dataset, history: xarray.Dataset) -> Figure:
    """Draws a swing with its gate times, moments, errors, and the flat-body rule.

    Args:
        bench: from `inertia_dataset`.  history: from `swing_history`.

    """
    figure: Figure = new_figure(10.0, 8.0)
    swing, moments, errors, flat = figure.subplots(2, 2).flat
    _swing(swing, history)
    _moments(moments, bench)
    _errors(errors, bench)
    _flat_body(flat, bench)
    for axes in (swing, moments, errors, flat):
        tidy(axes)
        axes.title.set_fontsize("medium")
    return figure


def _swing(axes: Any, history: xarray.Dataset) -> None:
    crossings = history["crossing"].to_numpy()
    timed = crossings[history.attrs["first_timed_crossing"] - 1 :: 2]
    axes.axvspan(timed[0], timed[-1], color="0.93", lw=0)
    axes.axhline(0.0, color="0.8", lw=0.8)
    axes.plot(history["time"], np.degrees(history["angle"]), color=BLUE, lw=1.2)
    axes.plot(crossings, np.zeros_like(crossings), "o", mfc="white", color=GREY, ms=5, ls="none")
    axes.plot(timed, np.zeros_like(timed), "o", color=VERMILION, ms=5, label="ends of timed swings")
    lines = history.attrs["title"].split(": ", 1)[1]
    axes.set(
        xlabel="time from letting go (s)",
        ylabel="angle from the vertical (deg)",
        title=f"{lines}\nperiod {history.attrs['period_s']:.5f} s",
    )
    top = float(np.degrees(history["angle"].max()))
    axes.set_ylim(-1.15 * top, 1.5 * top)
    axes.legend(frameon=False, loc="upper right")


def _moments(axes: Any, bench: xarray.Dataset) -> None:
    for racket, colour, x in _columns(bench):
        for axis, marker in _MARKERS.items():
            row = bench.sel(racket=racket, axis=axis)
            axes.plot(x, row["moment_input"], marker, mfc="none", color=colour, ms=10, ls="none")
            axes.plot(x, row["moment"], marker, color=colour, ms=4, ls="none")
    axes.set(
        yscale="log",
        ylabel="moment about the COM (kg m²)",
        title="Put in (open) and recovered (filled)",
    )
    _part_ticks(axes, bench)
    _axis_legend(axes, bench, "upper left")


def _errors(axes: Any, bench: xarray.Dataset) -> None:
    for racket, colour, x in _columns(bench):
        for axis, marker in _MARKERS.items():
            error = np.abs(bench["relative_error"].sel(racket=racket, axis=axis))
            axes.plot(x, error, marker, color=colour, ms=6, ls="none")
            row = bench.sel(racket=racket, axis=axis)
            share = row["moment_sd"] / row["moment_input"]
            axes.plot(x, share, marker, mfc="none", color=colour, ms=6, ls="none")
    axes.set(
        yscale="log",
        ylabel="relative to the moment put in (1)",
        title="Filled: error of the simulated bench\nOpen: standard deviation, by hand",
    )
    _part_ticks(axes, bench)


def _flat_body(axes: Any, bench: xarray.Dataset) -> None:
    """Ix + Iy against Iz of the head parts; sd of the sum from those of its terms."""
    rackets = [str(r) for r in bench["racket"].to_numpy()]
    head = bench.sel(part="head")
    sums = head["moment"].sel(axis=["longitudinal", "transverse"]).sum("axis")
    highest = max(float(sums.max()), float(head["moment"].max()))
    for i, racket in enumerate(rackets):
        row = head.sel(racket=racket)
        x, y, z = (row.sel(axis=a) for a in _MARKERS)
        total, total_sd = float(x["moment"] + y["moment"]), np.hypot(x["moment_sd"], y["moment_sd"])
        style = {"width": 0.32, "capsize": 3}
        first = i == 0
        axes.bar(
            i - 0.17, 1e3 * x["moment"], width=0.32, color=PURPLE, label="x" if first else None
        )
        axes.bar(
            i - 0.17,
            1e3 * y["moment"],
            bottom=1e3 * x["moment"],
            yerr=1e3 * total_sd,
            color=GREEN,
            label="y" if first else None,
            **style,
        )
        axes.bar(
            i + 0.17,
            1e3 * z["moment"],
            yerr=1e3 * z["moment_sd"],
            color="0.6",
            label="z" if first else None,
            **style,
        )
        excess = 100.0 * (total / float(z["moment"]) - 1.0)
        top = 1e3 * max(total + total_sd, float(z["moment"] + z["moment_sd"]))
        axes.annotate(
            f"x + y: {excess:+.1f} %", (i, top), (0, 6), textcoords="offset points", ha="center"
        )
    axes.set(
        xticks=range(len(rackets)),
        xticklabels=rackets,
        ylim=(0.0, 1.35e3 * highest),
        ylabel="moment of the head part (10⁻³ kg m²)",
        title="A flat body has x + y = z",
    )
    axes.legend(frameon=False, ncols=3, loc="upper center")


def _columns(bench: xarray.Dataset) -> list[tuple[str, str, Any]]:
    """Name, colour and places along the x axis of each racket."""
    rackets = [str(r) for r in bench["racket"].to_numpy()]
    spare = [c for c in (GREEN, PURPLE, BLUE, VERMILION) if c not in RACKET_COLOURS.values()]
    parts = np.arange(bench.sizes["part"])
    return [
        (
            racket,
            RACKET_COLOURS.get(racket, spare[i % len(spare)]),
            parts + 0.3 * (i - 0.5 * (len(rackets) - 1)),
        )
        for i, racket in enumerate(rackets)
    ]


def _part_ticks(axes: Any, bench: xarray.Dataset) -> None:
    parts = [str(p) for p in bench["part"].to_numpy()]
    axes.set(xticks=range(len(parts)), xticklabels=parts, xlim=(-0.5, len(parts) - 0.5))


def _axis_legend(axes: Any, bench: xarray.Dataset, place: str) -> None:
    """Markers tell axes, colours tell rackets."""
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], marker=marker, color="0.3", ls="none", label=_AXES[axis])
        for axis, marker in _MARKERS.items()
    ]
    handles += [
        Line2D([], [], marker="o", color=colour, ls="none", label=as_written(racket))
        for racket, colour, _ in _columns(bench)
    ]
    axes.legend(handles=handles, frameon=False, loc=place, fontsize="small")
