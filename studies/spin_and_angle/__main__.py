"""What do incidence, spin before and friction make of speed, angle and spin after?

    python -m studies.spin_and_angle --out spin_and_angle --workers 2

A ball with radius and spin (contact surface) meets the centre of the tour racket, free and in a
hand, at 0-70 degrees from the normal, with -4,000 to +4,000 rpm before (positive in friction's
sense) and with friction .3 to .6. Then the paper's two strokes: 31 m/s at 17 degrees (topspin
drive) and 25 m/s at 16 degrees (slice). Prints the strokes and what friction does to them; leaves
the sweeps (DIR/maps, DIR/strokes: SQLite, NetCDF, CSV) and a figure. The same call goes on where it
stopped.
"""

import argparse
import math
import sys
from pathlib import Path

import xarray

from drake_racket import (
    Progress,
    Scenario,
    check_directory,
    one_line_errors,
    write_figure,
)
from drake_racket.sweep import make_sweep, run_sweep
from studies.spin_and_angle.figures import maps_figure

FRICTION = "racket.friction.coefficients.mu1"
"""Of the centre, where the ball is aimed."""
OUTPUTS = ("rebound_speed", "rebound_angle_y", "spin_after_rpm", "sliding_fraction", "restitution")
STROKES = {"topspin drive": (31.0, 17.0), "slice": (25.0, 16.0)}
"""Speed (m/s) and incidence (degrees from the normal): Glynn et al. 2011, oblique impacts."""
BASE = Scenario(contact="surface", approach_time=1e-4, after=0.008, audit=False)


def report(progress: Progress) -> None:
    """One line on a terminal, written over."""
    if sys.stderr.isatty():
        end = "\n" if progress.done == progress.total else ""
        text = f"\r{progress.task}: {progress.done} of {progress.total}"
        print(text, end=end, file=sys.stderr, flush=True)


def axes_of(quick: bool) -> dict[str, object]:
    """Supports, spins and frictions of both sweeps."""
    spins = [-3000.0, 0.0, 3000.0] if quick else [1000.0 * i for i in range(-4, 5)]
    return {
        "support": ["free"] if quick else ["free", "grip"],
        "friction": {"key": FRICTION, "values": [0.3, 0.6] if quick else [0.3, 0.4, 0.5, 0.6]},
        "spin_rpm": {"values": spins, "unit": "rpm"},
    }


def print_strokes(dataset: xarray.Dataset, name: str, support: str) -> None:
    """Angle and spin of a stroke over spin before, for the least and the most friction."""
    speed, incidence = STROKES[name]
    print(f"{name}, {support}: {speed:g} m/s, {incidence:g} degrees from the normal")
    found = dataset.sel(support=support)
    for spin in found["spin_rpm"].to_numpy():
        cells = []
        for mu in (found["friction"].to_numpy()[i] for i in (0, -1)):
            one = found.sel(spin_rpm=spin, friction=mu)
            angle = math.degrees(float(one["rebound_angle_y"]))
            cells.append(
                f"mu {mu:g}: {angle:6.2f} deg, {float(one['spin_after_rpm']):6.0f} rpm,"
                f" slides {100 * float(one['sliding_fraction']):3.0f} %"
            )
        print(f"  {spin:6.0f} rpm before; " + "; ".join(cells))


def main() -> None:
    """Reads the options, runs the cases, prints and writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("spin_and_angle"))
    parser.add_argument("--speed", type=float, default=25.0, help="of the ball in the maps (m/s)")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--fresh", action="store_true", help="delete what is in DIR's sweeps")
    parser.add_argument("--quick", action="store_true", help="few cases")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    run = {"workers": options.workers, "fresh": options.fresh, "progress": report}
    angles = [0.0, 35.0, 70.0] if options.quick else [5.0 * i for i in range(15)]
    maps = make_sweep(
        Scenario(**{**vars(BASE), "speed": options.speed}),
        {**axes_of(options.quick), "incidence_deg": {"values": angles, "unit": "degrees"}},
        OUTPUTS,
    )
    dataset = run_sweep(maps, options.out / "maps", **run)
    for name, (speed, incidence) in STROKES.items():
        base = Scenario(**{**vars(BASE), "speed": speed, "incidence_deg": incidence})
        strokes = make_sweep(base, axes_of(options.quick), OUTPUTS)
        found = run_sweep(strokes, options.out / name.replace(" ", "_"), **run)
        for support in found["support"].to_numpy():
            print_strokes(found, name, str(support))
    write_figure(maps_figure(dataset, options.speed), options.out / "spin_and_angle.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies.spin_and_angle"):
        try:
            main()
        except KeyboardInterrupt:
            print("interrupted: finished cases are kept; the same call goes on", file=sys.stderr)
            sys.exit(130)
