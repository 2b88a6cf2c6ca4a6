"""The ball cannon against a racket whose head is held: restitution, and oblique rebound.

    python studies/head_clamped.py --out head_clamped

Normal impacts at nine points, six speeds and four beds; oblique ones for both stroke conditions,
both readings of friction and both readings of the angle. Leaves NetCDF, CSV and figures.
"""

import argparse
from pathlib import Path

import numpy as np

from drake_racket import check_directory, one_line_errors, write_figure, write_netcdf, write_table
from drake_racket.laws import POINT_NUMBERS
from drake_racket.plots import bed_maps, oblique_figure, restitution_over_speed
from drake_racket.rigs import CANNON_SPEEDS, normal_impacts, oblique_impacts


def main() -> None:
    """Reads the options, runs both rigs, prints and writes."""
    parser = argparse.ArgumentParser(description="Head-clamped normal and oblique impacts.")
    parser.add_argument("--out", type=Path, default=Path("head_clamped"), help="output directory")
    parser.add_argument("--racket", nargs="+", default=["tour", "recreational"])
    parser.add_argument("--tension", nargs="+", default=["low", "high"])
    parser.add_argument("--points", type=int, nargs="+", default=list(POINT_NUMBERS))
    parser.add_argument("--speeds", type=float, nargs="+", default=list(CANNON_SPEEDS), help="m/s")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    grid = {
        "rackets": options.racket,
        "tensions": options.tension,
        "points": options.points,
        "workers": options.workers,
    }
    normal = normal_impacts(speeds=options.speeds, **grid)
    oblique = oblique_impacts(**grid)
    print("Normal impacts: restitution, least to most over the points")
    for racket in options.racket:
        for tension in options.tension:
            bed = normal["restitution"].sel(racket=racket, tension=tension)
            spans = (
                f"{speed:g} m/s {float(bed.sel(speed=speed).min()):.3f}-"
                f"{float(bed.sel(speed=speed).max()):.3f}"
                for speed in options.speeds
            )
            print(f"  {racket}, {tension} tension:  " + ",  ".join(spans))
    print("Oblique impacts: rebound angle from the normal, mean over points and beds")
    mean = np.degrees(oblique["rebound_angle"].mean(["racket", "tension", "point"]))
    print(mean.to_series().round(2).to_string(header=False))
    options.out.mkdir(parents=True, exist_ok=True)
    first = options.racket[0], options.tension[0]
    middle = options.speeds[len(options.speeds) // 2]
    at_middle = normal.sel(speed=middle)
    for name, data in (("normal", normal), ("oblique", oblique)):
        write_netcdf(data, options.out / f"{name}.nc")
        write_table(data, options.out / f"{name}.csv")
    for name, figure in (
        ("restitution_over_speed", restitution_over_speed(normal)),
        ("restitution_map", bed_maps(at_middle, "restitution", title=f"{middle:g} m/s")),
        ("oblique", oblique_figure(oblique, *first)),
    ):
        write_figure(figure, options.out / f"{name}.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies/head_clamped.py"):
        main()
