"""What measurements tell of the string-bed's parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.plots import BED_STYLES, BLUE, GREY, VERMILION, new_figure, tidy

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WORST = 1.0  # relative error at which the colours end
_SHOWN = 2.0  # and the numbers: beyond it a parameter is not known at all


def per_cent(error: float) -> str:
    """A relative error as text in per cent; "" for nan."""
    if np.isnan(error):
        return ""
    if error > 99.95:
        return ">9999"
    return f"{100.0 * error:.1f}" if error < 0.0995 else f"{100.0 * error:.0f}"


def errors_figure(dataset: xarray.Dataset) -> Figure:
    """Relative standard errors (%) by case and parameter, one panel per bed.

    Args:
        dataset: from `identify.identifiability.identifiability_dataset`.

    """
    from matplotlib.colors import LogNorm

    dataset = dataset.dropna("parameter", how="all", subset=["standard_error"])
    beds, cases = dataset["bed"].to_numpy(), [str(c) for c in dataset["case"].to_numpy()]
    names = [str(n) for n in dataset["parameter"].to_numpy()]
    columns = min(len(beds), 2)
    rows = -(-len(beds) // columns)
    figure = new_figure(0.56 * len(names) * columns + 3.0, (0.31 * len(cases) + 0.8) * rows + 0.7)
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    image: Any = None
    for axes, bed in zip(panels.flat, beds, strict=False):
        errors = dataset["standard_error"].sel(bed=bed).to_numpy()
        shown = np.ma.masked_invalid(np.clip(errors, None, _WORST))
        image = axes.imshow(
            shown, norm=LogNorm(0.003, _WORST), cmap="cividis_r", aspect="auto", zorder=1
        )
        for i, row in enumerate(errors):
            for j, error in enumerate(row):
                colour = "white" if error > 0.07 else "black"
                weight = "bold" if error <= 0.1 else "normal"
                text = per_cent(float(error)) if not error > _SHOWN else f">{100 * _SHOWN:.0f}"
                style: dict[str, Any] = {"color": colour, "weight": weight, "fontsize": 8.5}
                axes.text(j, i, text, ha="center", va="center", **style)
        axes.set_title(str(bed), fontsize="medium")
        axes.set_xticks(range(len(names)), names)
        axes.set_yticks(range(len(cases)), cases, fontsize=9)
        axes.tick_params(length=0, labelbottom=True)
    for axes in list(panels.flat)[len(beds) :]:
        axes.set_visible(False)
    bar = figure.colorbar(image, ax=panels, shrink=0.6, pad=0.01)
    ticks = [0.01, 0.03, 0.1, 0.3, 1.0]
    bar.set_ticks(ticks, labels=["1", "3", "10", "30", "≥100"])
    bar.minorticks_off()
    bar.set_label("relative standard error (%)")
    figure.suptitle("How well measurements determine the string-bed (bold: to 10 % or better)")
    return figure


def directions_figure(dataset: xarray.Dataset, case: int = 0) -> Figure:
    """How well each independent combination is known, and what the combinations are.

    Args:
        dataset: from `identify.identifiability.identifiability_dataset`.
        case: number of the case shown; the right panel shows its first bed.

    """
    one = dataset.isel(case=case).dropna("direction", subset=["singular_value"], how="all")
    one = one.dropna("parameter", subset=["standard_error"], how="all")
    figure = new_figure(10.0, 4.6)
    axes, picture = figure.subplots(1, 2, width_ratios=(1.0, 1.15))
    for bed in one["bed"].to_numpy():
        racket, tension = str(bed).split()
        colour, line = BED_STYLES[racket, tension]
        values = 100.0 / one["singular_value"].sel(bed=bed)
        axes.plot(one["direction"], values, color=colour, ls=line, marker="o", ms=4, label=bed)
    for level in (10.0, 100.0):
        axes.axhline(level, color=GREY, lw=0.8, zorder=0)
        at = (1.0, level)
        axes.annotate(f"{level:g} %", at, textcoords="offset points", xytext=(-4, 3), color=GREY)
    axes.set(yscale="log", xlabel="number of the combination", ylabel="its standard error (%)")
    axes.set_xticks(one["direction"].to_numpy())
    axes.legend(frameon=False, fontsize=8)
    axes.set_title(str(one["case"].item()), fontsize="medium")
    tidy(axes)

    first = one.isel(bed=0)
    vectors = first["vector"].to_numpy()
    # the sign of a singular vector is free: the largest part is shown positive
    vectors = vectors * np.sign([row[np.argmax(np.abs(row))] for row in vectors])[:, None]
    image = picture.imshow(vectors, cmap="PuOr", vmin=-1.0, vmax=1.0, aspect="auto")
    for i, row in enumerate(vectors):
        for j, part in enumerate(row):
            if abs(part) >= 0.2:
                colour = "white" if abs(part) > 0.7 else "black"
                picture.text(
                    j, i, f"{part:.1f}", ha="center", va="center", fontsize=7, color=colour
                )
    picture.set_xticks(range(first.sizes["parameter"]), first["parameter"].to_numpy())
    errors = 100.0 / first["singular_value"].to_numpy()
    labels = [f"{n + 1}: {e:.3g} %" for n, e in enumerate(errors)]
    picture.set_yticks(range(len(labels)), labels, fontsize=8)
    picture.set_title(f"the combinations, {first['bed'].item()}", fontsize="medium")
    picture.tick_params(length=0)
    figure.colorbar(image, ax=picture, label="part of ln(parameter)", shrink=0.8)
    figure.suptitle("Combinations of parameters that are known, from best to worst")
    return figure


def profiles_figure(dataset: xarray.Dataset) -> Figure:
    """Likelihood profiles over the ratio to the true value, with their linear approximation.

    Args:
        dataset: from `identify.identifiability_refits.profiles_dataset`, or several of them along
            `bed`: a row of panels each.

    """
    if "bed" not in dataset.dims:
        dataset = dataset.expand_dims("bed")
    names, beds = dataset["parameter"].to_numpy(), dataset["bed"].to_numpy()
    figure = new_figure(2.2 * len(names) + 0.6, 2.3 * len(beds) + 1.2)
    panels = figure.subplots(len(beds), len(names), squeeze=False, sharey=True)
    for row, bed in zip(panels, beds, strict=True):
        for axes, name in zip(row, names, strict=True):
            _profile_panel(axes, dataset.sel(bed=bed, parameter=name), label=axes is panels[0, 0])
            axes.set_xlabel(f"{name} / true value")
        row[0].set_ylabel("χ² above its minimum")
        row[0].set_title(str(bed), loc="left", fontsize=9)
        row[-1].annotate(
            "95 %", (1.0, 1.96**2), xycoords=("axes fraction", "data"), ha="right", va="bottom",
            color=GREY,
        )  # fmt: skip
    panels[0, 0].plot([], [], color="black", ls=":", label="linear")
    figure.legend(loc="outside lower center", ncols=3, frameon=False, fontsize=9)
    figure.suptitle("Likelihood profiles: how far a parameter may be off")
    return figure


def _profile_panel(axes: Axes, shown: xarray.Dataset, *, label: bool) -> None:
    """The profiles of one parameter of one bed, a colour for each case."""
    for colour, case in zip((BLUE, VERMILION), shown["case"].to_numpy(), strict=False):
        one = shown.sel(case=case)
        ratio = one["ratio"].to_numpy()
        error = np.max(np.abs(np.log(ratio))) / np.sqrt(float(one["chi2_linear"].max()))
        at = np.geomspace(ratio[0], ratio[-1], 101)
        axes.plot(at, (np.log(at) / error) ** 2, color=colour, ls=":", lw=1.2)
        text = str(case) if label else None
        axes.plot(ratio, one["chi2"], color=colour, marker="o", ms=3.5, lw=1.4, label=text)
    axes.axhline(1.96**2, color=GREY, lw=0.8, ls="--")
    axes.set(xscale="log", ylim=(-0.2, 8.0))
    span = np.exp(np.max(np.abs(np.log(shown["ratio"].to_numpy()))))
    ticks = [0.2, 0.5, 1.0, 2.0, 5.0] if span > 2.0 else [0.8, 0.9, 0.95, 1.0, 1.05, 1.1, 1.2]
    ticks = [t for t in ticks if 0.98 / span <= t <= 1.02 * span]
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    axes.minorticks_off()
    tidy(axes)


def refits_figure(dataset: xarray.Dataset) -> Figure:
    """Every refit's estimate over its true value, with the linear answer's two standard errors.

    Args:
        dataset: from `identify.identifiability_refits.refits_dataset`.

    """
    cases, names = dataset["case"].to_numpy(), dataset["parameter"].to_numpy()
    figure = new_figure(5.0 * len(cases) + 0.4, 4.0)
    panels = figure.subplots(1, len(cases), squeeze=False, sharey=True)[0]
    for axes, case in zip(panels, cases, strict=True):
        one = dataset.sel(case=case)
        for i, name in enumerate(names):
            here = one.sel(parameter=name)
            values = np.exp(here["log_ratio"].to_numpy())
            shift = np.linspace(-0.3, 0.3, len(values))
            axes.plot(i + shift, values, ".", color=BLUE, ms=3.5)
            half = 2.0 * float(here["standard_error"])
            style: dict[str, Any] = {"color": VERMILION, "lw": 1.3}
            axes.vlines([i - 0.4, i + 0.4], np.exp(-half), np.exp(half), **style)
        axes.axhline(1.0, color=GREY, lw=0.8, zorder=0)
        axes.set(yscale="log", ylim=(1.0 / 35.0, 35.0), title=str(case), xlabel="parameter")
        ticks = [0.1, 0.3, 1.0, 3.0, 10.0]
        axes.set_yticks(ticks, [f"{t:g}" for t in ticks])
        axes.minorticks_off()
        axes.set_xticks(range(len(names)), names)
        tidy(axes)
    panels[0].set_ylabel("estimate / true value")
    figure.suptitle("Refits to noisy data (bars: two standard errors of the linear answer)")
    return figure
