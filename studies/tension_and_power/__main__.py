"""Does a looser string-bed give more speed? Stringing tension over 180-330 N, free and clamped.

    python -m studies.tension_and_power --out tension_and_power --workers 2

Both rackets, at rest, hit at 25 m/s at the centre, towards tip, throat and side. The rest of the
string-bed is as identified at two tensions of each racket: T0 in between and beyond is on the line
through the two (inferred; the stiffnesses stay the same). Prints the change over the range; leaves
the sweep (DIR/sweep: SQLite, NetCDF, CSV) and a figure. The same call goes on where it stopped.
"""

import argparse
import sys
from pathlib import Path

import xarray

from drake_racket import (
    IntegratorSettings,
    Progress,
    Scenario,
    check_directory,
    one_line_errors,
    write_figure,
)
from drake_racket.sweep import make_sweep, run_sweep
from studies.sample_figures import tension_figure

SHOWN = (  # variable, scale, unit, decimals
    ("restitution", 1.0, "", 3),
    ("rebound_speed", 1.0, "m/s", 2),
    ("contact_time", 1e3, "ms", 2),
    ("peak_normal_force", 1.0, "N", 0),
    ("peak_string_deflection", 1e3, "mm", 1),
)


def report(progress: Progress) -> None:
    """One line on a terminal, written over."""
    if sys.stderr.isatty():
        end = "\n" if progress.done == progress.total else ""
        text = f"\r{progress.task}: {progress.done} of {progress.total}"
        print(text, end=end, file=sys.stderr, flush=True)


def print_table(dataset: xarray.Dataset) -> None:
    """Every output at the lowest and the highest tension."""
    low, high = (float(dataset["tension"][i]) for i in (0, -1))
    print(f"from {low:g} N to {high:g} N stringing tension")
    heads = "".join(f"{n.replace('_', ' ')[-17:]:>20}" for n, *_ in SHOWN)
    print(f"{'':36}{heads}")
    for racket in dataset["racket"].to_numpy():
        for support in dataset["support"].to_numpy():
            for point in dataset["point"].to_numpy():
                bed = dataset.sel(racket=racket, support=support, point=point)
                cells = []
                for name, scale, unit, digits in SHOWN:
                    a, b = (scale * float(bed[name][i]) for i in (0, -1))
                    cells.append(f"{f'{a:.{digits}f} to {b:.{digits}f} {unit}':>20}")
                print(f"{racket:13} {support:13} point {point} {''.join(cells)}")


def main() -> None:
    """Reads the options, runs the cases, prints and writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("tension_and_power"))
    parser.add_argument("--speed", type=float, default=25.0, help="of the ball (m/s)")
    parser.add_argument("--points", type=int, nargs="+", default=[5, 2, 8, 4])
    parser.add_argument("--count", type=int, default=6, help="tensions, from 180 to 330 N")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--fresh", action="store_true", help="delete what is in DIR/sweep")
    parser.add_argument("--quick", action="store_true", help="one bed, two tensions")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    base = Scenario(
        speed=options.speed,
        approach_time=1e-4,
        after=0.01,
        audit=False,
        integrator=IntegratorSettings(accuracy=2e-2),  # moves restitution by less than 0.0001
    )
    tensions = {"from": 180.0, "to": 330.0, "count": options.count, "unit": "N"}
    sweep = make_sweep(
        base,
        {
            "racket": ["tour"] if options.quick else ["tour", "recreational"],
            "support": ["clamped_head"] if options.quick else ["free", "clamped_head"],
            "point": options.points[:1] if options.quick else options.points,
            "tension": {"values": [254.0, 311.0], "unit": "N"} if options.quick else tensions,
        },
    )
    directory = options.out / "sweep"
    dataset = run_sweep(
        sweep, directory, workers=options.workers, fresh=options.fresh, progress=report
    )
    print_table(dataset)
    write_figure(tension_figure(dataset), options.out / "tension.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies.tension_and_power"):
        try:
            main()
        except KeyboardInterrupt:
            print("interrupted: finished cases are kept; the same call goes on", file=sys.stderr)
            sys.exit(130)
