"""Figures of the sample studies: tension, frame stiffness, sweet spots; data from sweeps."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket import RacketParameters, load_racket
from drake_racket.plots import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    RACKET_COLOURS,
    SKY,
    VERMILION,
    draw_outline,
    new_figure,
    tidy,
)

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

_PLACES = {2: "towards tip", 5: "centre", 8: "towards throat", 4: "side", 6: "side"}
_LINES = ("-", "--", ":", "-.")
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">")
_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
_FEWEST_TENSION, _MOST_TENSION = 254.0, 311.0  # N, between which both rackets' T0 are printed
_SUPPORTS = {"grip": "in a hand", "clamped_head": "head clamped"}


def tension_figure(dataset: xarray.Dataset) -> Figure:
    """Rebound, contact time, force and deflection over the stringing tension, as change.

    Each curve is its change from the tension nearest to 254 N, at which both rackets' lower beds
    are identified; rows share a scale.

    Args:
        dataset: over (racket, support, point, tension).

    """
    shown = (
        ("rebound_speed", "rebound speed"),
        ("contact_time", "contact time"),
        ("peak_normal_force", "peak force"),
        ("peak_string_deflection", "peak string deflection"),
    )
    tension = dataset["tension"].to_numpy()
    nominal = int(np.argmin(np.abs(tension - _FEWEST_TENSION)))
    supports = [str(x) for x in dataset["support"].to_numpy()]
    points = dataset["point"].to_numpy()
    figure = new_figure(2.2 + 3.6 * len(supports), 10.0)
    panels = figure.subplots(len(shown), len(supports), sharex=True, sharey="row", squeeze=False)
    for row, (name, text) in zip(panels, shown, strict=True):
        for axes, support in zip(row, supports, strict=True):
            for racket in dataset["racket"].to_numpy():
                for n, point in enumerate(points):
                    at = dataset[name].sel(support=support, racket=racket, point=point)
                    axes.plot(
                        tension,
                        100.0 * (at / at[nominal] - 1.0),
                        color=RACKET_COLOURS.get(str(racket), "0.2"),
                        ls=_LINES[n % len(_LINES)],
                        marker=_MARKERS[n % len(_MARKERS)],
                        ms=4,
                        label=f"{racket}, {_place(int(point))}",
                    )
            axes.axvspan(_FEWEST_TENSION, _MOST_TENSION, color="0.94", zorder=0)
            tidy(axes)
        row[0].set_ylabel(f"change of\n{text} (%)")
    for axes, support in zip(panels[0], supports, strict=True):
        axes.set_title(_SUPPORTS.get(support, support))
    for axes in panels[-1]:
        axes.set_xlabel("stringing tension (N)")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False, fontsize=8)
    figure.suptitle(
        f"Stringing tension: change from {tension[nominal]:.0f} N\n"
        "(shaded: between both rackets' identified tensions)",
        fontsize=11,
    )
    return figure


def frame_figure(dataset: xarray.Dataset) -> Figure:
    """Rebound and mid-handle ringing over the frame's fundamental, by damping and point, as change.

    Each curve is its change from the racket as it is, stiffness and damping x 1.

    Args:
        dataset: over (support, point, stiffness, damping), with `fundamental` over stiffness.

    """
    shown = (
        ("rebound_speed", "change of\nrebound speed (%)"),
        ("handle_ringing", "change of mid-handle's ringing\nafter release, RMS (%)"),
    )
    stiffness, damped = dataset["stiffness"].to_numpy(), dataset["damping"].to_numpy()
    nominal = int(np.argmin(np.abs(np.log(stiffness)))), int(np.argmin(np.abs(np.log(damped))))
    supports = [str(x) for x in dataset["support"].to_numpy()]
    figure = new_figure(2.2 + 3.8 * len(supports), 7.4)
    panels = figure.subplots(2, len(supports), sharex=True, sharey="row", squeeze=False)
    for row, (name, text) in zip(panels, shown, strict=True):
        for axes, support in zip(row, supports, strict=True):
            for p, point in enumerate(dataset["point"].to_numpy()):
                here = dataset[name].sel(support=support, point=point)
                as_is = float(here.isel(stiffness=nominal[0], damping=nominal[1]))
                for c, damping in enumerate(damped):
                    axes.plot(
                        dataset["fundamental"],
                        100.0 * (here.sel(damping=damping) / as_is - 1.0),
                        color=_COLOURS[p % len(_COLOURS)],
                        ls=_LINES[c % len(_LINES)],
                        marker=_MARKERS[c % len(_MARKERS)],
                        ms=4,
                        label=f"{_place(int(point))}, damping x {damping:g}",
                    )
            tidy(axes)
            axes.axhline(0.0, color="0.85", lw=0.8, zorder=0)
        row[0].set_ylabel(text)
    for axes, support in zip(panels[0], supports, strict=True):
        axes.set_title(_SUPPORTS.get(support, support))
    for axes in panels[-1]:
        axes.set_xlabel("out-of-plane fundamental of the free frame (Hz)")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    figure.suptitle(
        f"Frame stiffness x {stiffness.min():g} to x {stiffness.max():g}: change from the racket"
        " as it is"
    )
    return figure


SWEET_SPOTS: Mapping[str, tuple[str, str, str, str]] = MappingProxyType(
    {
        "restitution": ("apparent restitution", "cividis", "", "most"),
        "handle_ringing": ("mid-handle after release, RMS", "cividis_r", "m/s²", "least"),
        "peak_hand_force": ("peak force on the hand", "cividis_r", "N", "least"),
    }
)
"""Variable -> title, colours (light is better), unit, and which end is sweet."""


def sweet_spot_figure(
    maps: Mapping[str, xarray.Dataset], closed_forms: Mapping[str, Mapping[str, float]]
) -> Figure:
    """Three maps on each racket's outline: a tile per aim, mirrored about the long axis.

    Args:
        maps: racket -> dataset along `aim` with `offset_x` and `offset_y` >= 0 (m) on a square
            grid, and the variables of SWEET_SPOTS.
        closed_forms: racket -> variable -> where its sweet spot should lie, m from the butt.

    """
    scales = {
        variable: (
            min(float(dataset[variable].min()) for dataset in maps.values()),
            max(float(dataset[variable].max()) for dataset in maps.values()),
        )
        for variable in SWEET_SPOTS
    }
    figure = new_figure(10.5, 3.9 * len(maps) + 1.0)
    panels = figure.subplots(len(maps), len(SWEET_SPOTS), squeeze=False)
    for (name, dataset), row in zip(maps.items(), panels, strict=True):
        racket = load_racket(name)
        for axes, (variable, (title, colours, unit, best)) in zip(
            row, SWEET_SPOTS.items(), strict=True
        ):
            tiles = _draw_tiles(axes, racket, dataset, variable, colours)
            tiles.set_clim(*scales[variable])
            _draw_cells(axes, racket)
            _mark_best(axes, racket, dataset, variable)
            if variable in closed_forms[name]:
                at = 1e3 * closed_forms[name][variable]
                axes.plot(0.0, at, "x", ms=10, mew=2.2, color=VERMILION, zorder=6)
            bar = figure.colorbar(tiles, ax=axes, shrink=0.75)
            bar.set_label(f"{title} ({unit})" if unit else title, fontsize=9)
            axes.set_title(f"{name}: {best} {variable.replace('_', ' ')}", fontsize=10)
            axes.set_axis_off()
    figure.suptitle("Sweet spots in a hand, 25 m/s, tip up; both rackets on one scale a column")
    figure.supxlabel(
        "ring: best aim; square: best on the long axis; cross: closed form (node of bending,"
        " centre of percussion for the hand)\n"
        "dashed: cells of the nine string masses; one half is computed",
        fontsize=9,
    )
    return figure


def _place(point: int) -> str:
    return f"point {point} ({_PLACES[point]})" if point in _PLACES else f"point {point}"


def _draw_tiles(
    axes: Any, racket: RacketParameters, dataset: xarray.Dataset, variable: str, colours: str
) -> Any:
    """A square per aim, coloured by its value; +y is on the left."""
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Rectangle

    draw_outline(axes, racket, along_x=False)
    centre = racket.point(5)[0]
    x, y = dataset["offset_x"].to_numpy(), dataset["offset_y"].to_numpy()
    values = dataset[variable].to_numpy()
    step = 1e3 * float(np.diff(np.unique(x)).min())
    patches, numbers = [], []
    for sign in (1.0, -1.0):
        for along, aside, value in zip(x, y, values, strict=True):
            corner = (-sign * 1e3 * aside - 0.5 * step, 1e3 * (centre + along) - 0.5 * step)
            patches.append(Rectangle(corner, step, step))
            numbers.append(value)
    tiles = PatchCollection(patches, cmap=colours, zorder=2, edgecolor="face", linewidth=0.2)
    tiles.set_array(np.array(numbers))
    axes.add_collection(tiles)
    length = 1e3 * racket.handle.length.value
    axes.set_ylim(length - 25.0, length + 1e3 * racket.head.length.value + 8.0)
    return tiles


def _draw_cells(axes: Any, racket: RacketParameters) -> None:
    """Borders between the aims that meet one string mass and those that meet the next."""
    from matplotlib.patheffects import Normal, Stroke

    bed = racket.string_bed
    centre, half = racket.point(5)[0], 0.5 * bed.spacing.value
    a, b = bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
    across = b * np.sqrt(1.0 - (half / a) ** 2)
    along = a * np.sqrt(1.0 - (half / b) ** 2)
    for sign in (1.0, -1.0):
        style = {
            "color": "white",
            "ls": (0, (5, 3)),
            "lw": 1.3,
            "zorder": 4,
            "path_effects": [Stroke(linewidth=2.8, foreground="0.15"), Normal()],
        }
        level = 1e3 * (centre + sign * half)
        axes.plot([-1e3 * across, 1e3 * across], [level, level], **style)
        aside = 1e3 * sign * half
        axes.plot([aside, aside], [1e3 * (centre - along), 1e3 * (centre + along)], **style)


def best_aim(dataset: xarray.Dataset, variable: str, *, on_axis: bool = False) -> int:
    """The aim at which a variable of SWEET_SPOTS is sweet, of all or of those on the long axis."""
    values = dataset[variable].to_numpy()
    if SWEET_SPOTS[variable][3] == "most":
        values = -values
    if on_axis:
        values = np.where(dataset["offset_y"].to_numpy() == 0.0, values, np.inf)
    return int(values.argmin())


def _mark_best(axes: Any, racket: RacketParameters, dataset: xarray.Dataset, variable: str) -> None:
    for marker, on_axis in (("o", False), ("s", True)):
        at = best_aim(dataset, variable, on_axis=on_axis)
        along = 1e3 * (racket.point(5)[0] + float(dataset["offset_x"][at]))
        aside = 1e3 * float(dataset["offset_y"][at])
        for sign in (1.0, -1.0) if aside else (1.0,):
            style = {"mfc": "none", "mec": VERMILION, "mew": 2.2, "zorder": 6}
            axes.plot(sign * aside, along, marker, ms=13 if on_axis else 10, **style)
