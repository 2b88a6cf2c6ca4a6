"""Three sweet spots: most restitution, least vibration, least shock at the hand.

    python -m studies.sweet_spots --out sweet_spots --workers 2

Each racket is in a hand at rest (grip normal, inferred) and is hit at 25 m/s at aims on a grid
within the rim; both halves are alike, so one is computed. The ball has radius and meets the strings
anywhere (contact surface): the maps are continuous. With `--contact paper` it is a point that meets
the nearest of nine string masses, and they jump from one mass's cell to the next (dashed). The best
aims are compared with closed forms of the free
racket: the node of bending, and the centre of percussion for the hand's place. Leaves a sweep for
each racket (DIR/RACKET), tables (CSV) and the maps.
"""

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from drake_racket import (
    SWINGWEIGHT_AXIS,
    InputError,
    IntegratorSettings,
    Progress,
    RacketParameters,
    Scenario,
    check_directory,
    load_racket,
    one_line_errors,
    racket_properties,
    write_figure,
    write_table,
)
from drake_racket.rigs import head_node
from drake_racket.sweep import make_sweep, run_sweep
from studies.sample_figures import SWEET_SPOTS, best_aim, sweet_spot_figure

REACH = 0.85  # of the rim's semi-axes: beyond it the ball would meet the frame


def aims(racket: RacketParameters, step: float) -> list[list[float]]:
    """Offsets (x, y >= 0) from the string-bed centre, `step` apart (m)."""
    bed = racket.string_bed
    a, b = REACH * bed.rim_semi_axis_x.value, REACH * bed.rim_semi_axis_y.value
    count = int(a / step)
    return [
        [round(i * step, 6), round(j * step, 6)]
        for i in range(-count, count + 1)
        for j in range(int(b / step) + 1)
        if (i * step / a) ** 2 + (j * step / b) ** 2 <= 1.0
    ]


def closed_forms(racket: RacketParameters) -> dict[str, float]:
    """Node of bending, and centre of percussion of the rigid racket for the hand (m from butt)."""
    p = racket_properties(racket)
    about_com = p.swingweight - p.mass * (p.balance - SWINGWEIGHT_AXIS) ** 2
    arm = p.balance - racket.landmarks.grip.value
    return {
        "handle_ringing": head_node(racket),
        "peak_hand_force": p.balance + about_com / (p.mass * arm),
    }


def report(progress: Progress) -> None:
    """One line on a terminal, written over."""
    if sys.stderr.isatty():
        end = "\n" if progress.done == progress.total else ""
        text = f"\r{progress.task}: {progress.done} of {progress.total}"
        print(text, end=end, file=sys.stderr, flush=True)


def print_spots(name: str, dataset: xarray.Dataset, closed: dict[str, float]) -> None:
    """Where each map is best, on the whole bed and on the long axis, and what it has there."""
    centre = load_racket(name).point(5)[0]
    x, y = (dataset[f"offset_{a}"].to_numpy() for a in "xy")
    for variable, (_, _, unit, best) in SWEET_SPOTS.items():
        values = dataset[variable].to_numpy()
        every, axis = (best_aim(dataset, variable, on_axis=on_axis) for on_axis in (False, True))
        middle = int(np.hypot(x, y).argmin())
        print(
            f"{name}, {best} {variable.replace('_', ' ')}: {values[every]:.4g} {unit}"
            f" at {1e3 * x[every]:+.0f} mm along, {1e3 * y[every]:.0f} mm aside;"
            f" on the axis {values[axis]:.4g} {unit} at {1e3 * x[axis]:+.0f} mm"
            f", at the centre {values[middle]:.4g} {unit}"
        )
        if variable in closed:
            at = 1e3 * (closed[variable] - centre)
            print(f"  closed form: {at:+.0f} mm along the axis")


def main() -> None:
    """Reads the options, runs the cases, prints and writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("sweet_spots"))
    parser.add_argument("--racket", nargs="+", default=["tour", "recreational"])
    parser.add_argument("--step", type=float, default=0.005, help="between aims (m)")
    parser.add_argument("--contact", choices=["surface", "paper"], default="surface")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--fresh", action="store_true", help="delete what is in DIR/RACKET")
    parser.add_argument("--quick", action="store_true", help="a handful of aims, a short run")
    options = parser.parse_args()
    if not 0.005 <= options.step <= 0.1:
        raise InputError("--step", options.step, "0.005 to 0.1 m")
    check_directory(options.out, "--out")
    maps: dict[str, Any] = {}
    closed: dict[str, dict[str, float]] = {}
    for name in options.racket[:1] if options.quick else options.racket:
        base = Scenario(
            racket=name,
            support="grip",
            point="auto",
            contact=options.contact,
            approach_time=1e-4,
            after=0.008 if options.quick else 0.03,
            audit=False,
            integrator=IntegratorSettings(accuracy=2e-2),  # moves the ringing by less than 1 %
        )
        racket = load_racket(name)
        rows = aims(racket, 0.1 if options.quick else options.step)
        keys = {"offset_x": {"unit": "m"}, "offset_y": {"unit": "m"}}
        outputs = ["restitution", "handle_ringing", "peak_hand_force", "touched_point"]
        sweep = make_sweep(base, {"aim": {"keys": keys, "rows": rows}}, outputs)
        directory = options.out / Path(name).stem
        maps[name] = run_sweep(
            sweep, directory, workers=options.workers, fresh=options.fresh, progress=report
        )
        closed[name] = closed_forms(racket)
        print_spots(name, maps[name], closed[name])
        table = maps[name].drop_vars(["sweep", "scenario_hash", "status", "failure"])
        write_table(table, options.out / f"{Path(name).stem}.csv")
    write_figure(sweet_spot_figure(maps, closed), options.out / "sweet_spots.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies.sweet_spots"):
        try:
            main()
        except KeyboardInterrupt:
            print("interrupted: finished cases are kept; the same call goes on", file=sys.stderr)
            sys.exit(130)
