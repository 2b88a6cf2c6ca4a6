"""Draws the string-bed pressed slowly."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drake_racket.plots.style import BED_STYLES, as_written, new_figure, tidy

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


def stiffness_figure(dataset: xarray.Dataset, difference: xarray.Dataset) -> Figure:
    """Draws force over deflection, secant stiffness, and how well beds of two rackets match.

    Args:
        dataset, difference: from `rigs.static_stiffness.stiffness_dataset` and `mean_difference`.

    """
    figure = new_figure(10.5, 3.8)
    curve, stiffness, match = figure.subplots(1, 3)
    point = 5 if 5 in dataset["point"].to_numpy() else int(dataset["point"][0])
    force = dataset["force"]
    for racket in dataset["racket"].to_numpy():
        for tension in dataset["tension"].to_numpy():
            bed = dataset.sel(racket=racket, tension=tension, point=point)
            colour, style = BED_STYLES[racket, tension]
            label = f"{as_written(racket)}, {tension}"
            curve.plot(1e3 * bed["deflection"], force, color=colour, ls=style, label=label)
            stiffness.plot(force, 1e-3 * bed["secant_stiffness"], color=colour, ls=style)
    curve.set(xlabel="deflection (mm)", ylabel="force (N)", title=f"Point {point}")
    stiffness.set(
        xlabel="force (N)", ylabel="secant stiffness (kN/m)", title=f"Point {point}", ylim=(0, None)
    )
    curve.legend(frameon=False, fontsize=8)
    beds = [str(name) for name in difference["bed"].to_numpy()]
    first = [b for b in beds if b.startswith(str(dataset["racket"].to_numpy()[0]))]
    for n, (a, b) in enumerate((a, b) for a in first for b in beds if b not in first):
        value = 100.0 * difference["difference"].sel(bed=a, other=b)
        matched = (a, b) == ("tour low", "recreational high")
        match.plot(
            force,
            value,
            color="black" if matched else "0.6",
            lw=2.2 if matched else 1.2,
            ls=("-", "--", ":", "-.")[n % 4],
            label=f"{a} and {b}",
        )
    match.set(
        xlabel="force (N)", ylabel="mean difference over points (%)", title="Match", ylim=(0, None)
    )
    match.legend(frameon=False, fontsize=7)
    for axes in (curve, stiffness, match):
        tidy(axes)
    figure.suptitle("String-bed pressed slowly, head held")
    return figure
