"""The string-bed pressed slowly: force and deflection by point, and which beds match.

    python studies/static_stiffness.py --out static_stiffness

Leaves NetCDF, CSV and a figure.
"""

import argparse
from pathlib import Path

from drake_racket import check_directory, one_line_errors, write_figure, write_netcdf, write_table
from drake_racket.laws import POINT_NUMBERS
from drake_racket.plots import stiffness_figure
from drake_racket.rigs import FORCES, mean_difference, stiffness_dataset


def main() -> None:
    """Reads the options, runs the rig, prints and writes."""
    parser = argparse.ArgumentParser(description="Static string-bed stiffness by point.")
    parser.add_argument("--out", type=Path, default=Path("static_stiffness"), help="directory")
    parser.add_argument("--points", type=int, nargs="+", default=list(POINT_NUMBERS))
    parser.add_argument("--forces", type=float, nargs="+", default=list(FORCES), help="N")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    dataset = stiffness_dataset(points=options.points, forces=options.forces)
    difference = mean_difference(dataset)
    for force in (options.forces[0], options.forces[-1]):
        print(f"secant stiffness at {force:g} N (kN/m), by point {options.points}")
        for racket in ("tour", "recreational"):
            for tension in ("low", "high"):
                bed = dataset["secant_stiffness"].sel(racket=racket, tension=tension, force=force)
                numbers = "  ".join(f"{1e-3 * float(k):5.1f}" for k in bed)
                print(f"  {racket + ', ' + tension:20} {numbers}")
    matched = difference["difference"].sel(bed="tour low", other="recreational high")
    best = float(matched.idxmin("force"))
    print(
        "tour low and recreational high match best at"
        f" {best:g} N: mean difference {100 * float(matched.min()):.1f} %"
    )
    options.out.mkdir(parents=True, exist_ok=True)
    write_netcdf(dataset, options.out / "stiffness.nc")
    write_netcdf(difference, options.out / "difference.nc")
    write_table(dataset, options.out / "stiffness.csv")
    write_figure(stiffness_figure(dataset, difference), options.out / "stiffness.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies/static_stiffness.py"):
        main()
