"""The inertia bench: what pendulums, a torsional pendulum and knife-edges recover of each racket.

    python studies/inertia_bench.py --out inertia_bench

Simulates the source's inertia measurements on handle part, head part, bare frame and strung
racket, runs them through the sums a laboratory would do, and sets the result beside what was put
in. Leaves inertia_bench.nc (all of it), inertia_bench.csv (moments), swing.nc (one pendulum
run) and inertia_bench.png.
"""

import argparse
from pathlib import Path

import numpy as np

from drake_racket import check_directory, one_line_errors, write_figure, write_netcdf, write_table
from drake_racket.plots import inertia_bench_figure
from drake_racket.rigs import bending_error, inertia_dataset, swing_history


def print_tables(bench) -> None:
    """The moments, the balance, and the strung rackets as makers quote them."""
    print("racket        part    axis          period s  recovered kg m^2     sd  put in    error")
    for racket in bench["racket"].to_numpy():
        for part in bench["part"].to_numpy():
            for axis in bench["axis"].to_numpy():
                row = bench.sel(racket=racket, part=part, axis=axis)
                print(
                    f"{racket:13s} {part:7s} {axis:12s} {float(row.period):9.5f}"
                    f"  {float(row.moment):16.9f} {float(row.moment_sd):6.0e}"
                    f" {float(row.moment_input):7.5f} {float(row.relative_error):+8.0e}"
                )
    print("\nracket        part     mass kg  balance m  (put in)")
    for racket in bench["racket"].to_numpy():
        for part in bench["part"].to_numpy():
            row = bench.sel(racket=racket, part=part)
            print(
                f"{racket:13s} {part:7s} {float(row.mass):8.5f}  {float(row.com):9.6f}"
                f"  ({float(row.com_input):.6f})"
            )
    print("\nstrung        swingweight  spinweight  twistweight (kg cm^2; sd by hand)")
    for racket in bench["racket"].to_numpy():
        row = bench.sel(racket=racket)
        numbers = [
            f"{1e4 * float(row[name]):7.2f} ±{1e4 * float(row[name + '_sd']):4.2f}"
            for name in ("swingweight", "spinweight", "twistweight")
        ]
        print(f"{racket:13s} " + " ".join(numbers))


def main() -> None:
    """Runs the bench and writes what it found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("inertia_bench"), help="output directory")
    parser.add_argument("--racket", nargs="+", default=["tour", "recreational"])
    parser.add_argument("--amplitude", type=float, default=10.0, help="of release, degrees")
    parser.add_argument("--oscillations", type=int, default=3, help="timed swings")
    parser.add_argument("--no-bending", action="store_true", help="leave the flexible frame out")
    arguments = parser.parse_args()
    check_directory(arguments.out, "--out")
    settings = {
        "amplitude": float(np.radians(arguments.amplitude)),
        "oscillations": arguments.oscillations,
    }
    bench = inertia_dataset(arguments.racket, **settings)
    history = swing_history(arguments.racket[0], **settings)
    print_tables(bench)
    if not arguments.no_bending:
        bench["bending_error"] = bending_error(
            arguments.racket, amplitude=settings["amplitude"]
        ).reindex(axis=bench["axis"])
        print("\nthe frame's bending changes the pendulum's moment by a relative")
        for racket in arguments.racket:
            row = bench["bending_error"].sel(racket=racket)
            print(
                f"{racket:13s} {float(row.sel(axis='transverse')):+.1e} (transverse),"
                f" {float(row.sel(axis='frontal')):+.1e} (frontal)"
            )
    arguments.out.mkdir(parents=True, exist_ok=True)
    write_netcdf(bench, arguments.out / "inertia_bench.nc")
    moments = ["period", "moment", "moment_sd", "moment_input", "relative_error"]
    write_table(bench[moments].drop_vars("pivot"), arguments.out / "inertia_bench.csv")
    write_netcdf(history, arguments.out / "swing.nc")
    write_figure(inertia_bench_figure(bench, history), arguments.out / "inertia_bench.png")
    print(f"\nwrote {arguments.out}")


if __name__ == "__main__":
    with one_line_errors("studies/inertia_bench.py"):
        main()
