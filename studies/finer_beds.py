"""Beds of 3 x 3, 5 x 5 and 7 x 7 masses: what does a ball find between the points?

    python studies/finer_beds.py --out finer_beds

Same total mass, rim and frame; tension and springs calibrated so that the nine points give way as
they do in the bed of nine. Normal impacts on the clamped head along both axes of the bed, and the
bed pressed slowly. Prints both, leaves NetCDF and a figure.
"""

import argparse
from pathlib import Path

import xarray
from matplotlib.figure import Figure

from drake_racket import check_directory, load_racket, one_line_errors, write_figure, write_netcdf
from drake_racket.plots import BLUE, GREEN, VERMILION, new_figure, tidy
from drake_racket.rigs import convergence

SHOWN = (
    ("restitution", 1.0, "restitution"),
    ("contact_time", 1e3, "contact time (ms)"),
    ("deflection", 1e3, "deflection under 800 N (mm)"),
)


def convergence_figure(dataset: xarray.Dataset) -> Figure:
    """Restitution, contact time and deflection over the place, two lines per bed."""
    figure = new_figure(11.0, 3.9)
    for axes, (name, scale, label) in zip(figure.subplots(1, 3), SHOWN, strict=True):
        colours = (VERMILION, GREEN, BLUE)
        for i, lines in enumerate(dataset["lines"].to_numpy()):
            for axis, style in (("x", "-"), ("y", "--")):
                values = dataset[name].sel(lines=lines, axis=axis)
                text = f"{lines} x {lines}, along {axis}"
                place = 1e3 * dataset["place"]
                axes.plot(place, scale * values, style, color=colours[i % 3], label=text)
        axes.set_xlabel("place from the centre (mm)")
        axes.set_ylabel(label)
        tidy(axes)
    axes.legend(frameon=False, fontsize=8)
    figure.suptitle(str(dataset.attrs["title"]))
    return figure


def main() -> None:
    """Reads the options, runs the rig, prints and writes."""
    parser = argparse.ArgumentParser(description="Beds of more masses, on and between points.")
    parser.add_argument("--out", type=Path, default=Path("finer_beds"), help="directory")
    parser.add_argument("--racket", default="tour", help="a name, or a racket's file")
    parser.add_argument("--lines", type=int, nargs="+", default=[3, 5, 7])
    parser.add_argument("--speed", type=float, default=25.0, help="m/s")
    parser.add_argument("--step", type=float, default=0.0685 / 12.0, help="of the places (m)")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    racket = load_racket(options.racket)
    dataset = convergence(racket, lines=options.lines, speed=options.speed, step=options.step)
    for lines in options.lines:
        bed = dataset.sel(lines=lines)
        e, t, z = (scale * bed[name] for name, scale, _ in SHOWN)
        print(
            f"{lines} x {lines}: tau {float(bed['tension']):.3f}, sigma"
            f" {float(bed['stiffness']):.3f}; restitution {float(e.min()):.3f} to"
            f" {float(e.max()):.3f}, contact {float(t.min()):.2f} to {float(t.max()):.2f} ms,"
            f" deflection {float(z.min()):.1f} to {float(z.max()):.1f} mm"
        )
    options.out.mkdir(parents=True, exist_ok=True)
    write_netcdf(dataset, options.out / "finer_beds.nc")
    write_figure(convergence_figure(dataset), options.out / "finer_beds.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies/finer_beds.py"):
        main()
