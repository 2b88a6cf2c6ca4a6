"""Modal analysis of the rackets: fundamentals, mode shapes, nodes, string-bed modes, and the grip.

    python studies/frame_modes.py --out frame_modes

Prints the fundamentals beside the published ones, nodes and antinodes exact and by the source's
quadratic regression, and the string-bed's modes; writes data (NetCDF, CSV) and figures (PNG).
"""

import argparse
from pathlib import Path

import numpy as np
import xarray

from drake_racket import (
    RACKETS,
    check_directory,
    load_racket,
    one_line_errors,
    write_figure,
    write_netcdf,
    write_table,
)
from drake_racket.plots import frame_modes_figure, grip_figure, string_modes_figure
from drake_racket.rigs import (
    GRIP_FACTORS,
    PLANES,
    SAMPLES,
    check_samples,
    fundamentals_table,
    grip_sweep,
    modes_dataset,
    string_bed_coupling,
)


def main() -> None:
    """Reads the options, runs the rigs, and writes what they give."""
    parser = argparse.ArgumentParser(description="Modal analysis of the rackets.")
    parser.add_argument("--out", type=Path, default=Path("frame_modes"), help="output directory")
    parser.add_argument("--racket", nargs="+", default=list(RACKETS), help="tour, recreational")
    parser.add_argument("--tension", default="low", help="low, high or N (stringing tension)")
    parser.add_argument(
        "--samples", type=int, default=SAMPLES, help="points along the axis for the regression"
    )
    parser.add_argument("--quick", action="store_true", help="few grips")
    arguments = parser.parse_args()
    check_directory(arguments.out, "--out")
    check_samples(arguments.samples)
    for racket in arguments.racket:  # bad names fail before anything is written
        load_racket(racket, arguments.tension)
    arguments.out.mkdir(parents=True, exist_ok=True)
    table = fundamentals_table(rackets=arguments.racket, tension=arguments.tension)
    print_fundamentals(table)
    write_netcdf(table, arguments.out / "fundamentals.nc")
    full = table.assign(
        published_frequency=table["published_frequency"].broadcast_like(table["frequency"])
    )
    write_table(full.transpose(*table["frequency"].dims), arguments.out / "fundamentals.csv")
    factors = GRIP_FACTORS[::6] if arguments.quick else GRIP_FACTORS
    sweeps = []
    for racket in arguments.racket:
        study_racket(racket, arguments)
        sweeps.append(grip_sweep(racket, arguments.tension, factors=factors))
        write_netcdf(sweeps[-1], arguments.out / f"grip_{Path(racket).stem}.nc")
    write_figure(grip_figure(sweeps), arguments.out / "grip.png")
    print(f"wrote {arguments.out}")


def print_fundamentals(table: xarray.Dataset) -> None:
    """Prints the bending frequencies of all cases."""
    print("Fundamentals (Hz); free racket, difference from the published frequency in %")
    print(f"{'racket':14}{'joint labels':14}{'frame':8}{'in plane':>20}{'out of plane':>20}")
    free = table.sel(support="free").stack(case=("racket", "joint_reading", "strung"))
    for case in free["case"].to_numpy():
        row = free.sel(case=case)
        cells = [
            f"{float(row['frequency'].sel(plane=p)):11.1f}"
            f" ({100 * float(row['difference'].sel(plane=p)):+5.1f})"
            for p in PLANES
        ]
        print(
            f"{case[0]:14}{case[1]:14}{'strung' if case[2] else 'bare':8}{cells[0]}{cells[1]:>22}"
        )
    print("Other supports, bare frame, by_axis (Hz; damping ratio)")
    for racket in table["racket"].to_numpy():
        for support in table["support"].to_numpy()[1:]:
            row = table.sel(racket=racket, support=support, strung=False, joint_reading="by_axis")
            frequency, damping = row["frequency"].to_numpy(), row["damping_ratio"].to_numpy()
            cells = "".join(f"{f:11.1f} ({d:.3f})" for f, d in zip(frequency, damping, strict=True))
            print(f"{racket:14}{support:22}{cells}")


def study_racket(racket: str, arguments: argparse.Namespace) -> None:
    """Shapes, nodes and string-bed modes of one racket, bare and strung."""
    parameters, stem = load_racket(racket, arguments.tension), Path(racket).stem
    for strung in (False, True):
        modes = modes_dataset(racket, arguments.tension, strung=strung, samples=arguments.samples)
        name = f"{stem}_{'strung' if strung else 'bare'}"
        write_netcdf(modes, arguments.out / f"modes_{name}.nc")
        figure = frame_modes_figure(modes, parameters)
        write_figure(figure, arguments.out / f"modes_{name}.png")
        print(f"Nodes and antinodes, {name}, free (mm from the butt)")
        for plane in PLANES:
            mode = modes.isel(mode=int(np.argmax(modes["strain_share"].sel(element=plane).data)))
            for how in ("exact", "regression"):
                low, high = 1e3 * mode[f"node_{how}"].to_numpy()
                antinode = 1e3 * float(mode[f"antinode_{how}"])
                print(
                    f"  {plane:14}{how:12} nodes {low:6.1f} {high:6.1f}   antinode {antinode:6.1f}"
                    f"   (published {1e3 * float(mode['published_antinode']):.0f})"
                )
    coupling = string_bed_coupling(racket, arguments.tension)
    write_netcdf(coupling, arguments.out / f"string_modes_{stem}.nc")
    write_figure(
        string_modes_figure(coupling, parameters), arguments.out / f"string_modes_{stem}.png"
    )
    print(f"String-bed modes, {stem}: head clamped -> racket free (Hz)")
    for mode in coupling["mode"].to_numpy():
        row = coupling.sel(mode=mode)
        print(
            f"  {mode}  {float(row['frequency']):7.1f} -> {float(row['frequency_free']):7.1f}"
            f"  ({100 * float(row['shift']):+.2f} %)"
            f"  left-right {float(row['lateral_symmetry']):+.0f}"
            f"  tip-throat {float(row['axial_symmetry']):+.0f}"
        )


if __name__ == "__main__":
    with one_line_errors("studies/frame_modes.py"):
        main()
