"""A racket that may move: apparent restitution and vibration over the string-bed.

    python studies/moving_racket.py --out moving_racket

Free, in a hand-like grip, and clamped at the handle; at the nine points, and along the long axis of
the free racket, where bending is excited least at its node. Leaves NetCDF, CSV and figures.
"""

import argparse
from pathlib import Path

from drake_racket import (
    check_directory,
    load_racket,
    one_line_errors,
    write_figure,
    write_netcdf,
    write_table,
)
from drake_racket.laws import POINT_NUMBERS
from drake_racket.plots import along_axis_figure, bed_maps
from drake_racket.rigs import along_axis, axis_offsets, head_node, restitution_map


def main() -> None:
    """Reads the options, runs the rig, prints and writes."""
    parser = argparse.ArgumentParser(description="Impacts on a racket that may move, 25 m/s.")
    parser.add_argument("--out", type=Path, default=Path("moving_racket"), help="output directory")
    parser.add_argument("--racket", nargs="+", default=["tour", "recreational"])
    parser.add_argument("--support", nargs="+", default=["free", "grip", "clamped_handle"])
    parser.add_argument("--points", type=int, nargs="+", default=list(POINT_NUMBERS))
    parser.add_argument("--step", type=float, default=0.01, help="along the axis (m)")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    points = restitution_map(
        rackets=options.racket,
        supports=options.support,
        points=options.points,
        workers=options.workers,
    )
    axis = along_axis(axis_offsets(options.step), rackets=options.racket, workers=options.workers)
    nodes = {racket: head_node(load_racket(racket)) for racket in options.racket}
    for racket in options.racket:
        for support in options.support:
            case = points.sel(racket=racket, support=support)
            print(f"{racket}, {support.replace('_', ' ')}")
            for point in options.points:
                at = case.sel(point=point)
                print(
                    f"  point {point}: restitution {float(at['restitution']):.3f},"
                    f" mid-handle peak {float(at['peak_handle_acceleration']):.0f} m/s^2,"
                    f" bending after release {1e3 * float(at['bending_angle']):.1f} mrad"
                )
        line = axis.sel(racket=racket)
        least = float(line["offset_x"][int(line["bending_angle"].argmin())])
        centre = load_racket(racket).point(5)[0]
        print(
            f"{racket}, free: bending is excited least {1e3 * least:+.0f} mm from the centre"
            f" (node of bending {1e3 * (nodes[racket] - centre):+.0f} mm)"
        )
    options.out.mkdir(parents=True, exist_ok=True)
    for name, data in (("points", points), ("along_axis", axis)):
        write_netcdf(data, options.out / f"{name}.nc")
        write_table(data, options.out / f"{name}.csv")
    for name, figure in (
        ("restitution", bed_maps(points, "restitution", title="Apparent restitution, 25 m/s")),
        ("mid_handle", bed_maps(points, "peak_handle_acceleration", title="Mid-handle, 25 m/s")),
        ("along_axis", along_axis_figure(axis, nodes)),
    ):
        write_figure(figure, options.out / f"{name}.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies/moving_racket.py"):
        main()
