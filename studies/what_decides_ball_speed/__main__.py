"""What decides ball speed, wrist load and mid-handle vibration: Sobol indices.

    python -m studies.what_decides_ball_speed --out what_decides_ball_speed --workers 2

Five parameters, each uniform over an inferred span: frame stiffness (both planes, as a factor),
stringing tension, mass moved from the handle's centre of mass to the head's, and the impact point
on both axes of the string-bed. The tour racket is in a hand at rest (grip normal). Outputs: ball
speed, peak torque on the hand, and mid-handle's ringing after release.

Ball speed is e v_ball + (1 + e) v_racket with the apparent restitution e: the frame in which the
hand stands still moves at v_racket, everywhere alike (the racket does not turn about anything).

The ball meets the nearest of nine string masses: what changes with the impact point within a mass's
share of the bed (68.5 mm) is the lever, not the strings. Needs SALib (extra `sensitivity`). Cases
that are finished stay in DIR/sweep: the same call goes on.
"""

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from drake_racket import (
    Progress,
    Scenario,
    check_directory,
    load_racket,
    one_line_errors,
    write_figure,
    write_netcdf,
    write_table,
)
from drake_racket.sweep import (
    SobolDesign,
    Span,
    Sweep,
    make_sweep,
    run_sweep,
    sobol_design,
    sobol_indices,
)
from studies.what_decides_ball_speed.figures import sensitivity_figure

SPANS = {
    "frame stiffness": Span(0.7, 1.4, "1", relative=True),
    "stringing tension": Span(200.0, 320.0, "N"),
    "mass moved to the head": Span(-0.010, 0.010, "kg"),
    "impact point, x": Span(-0.100, 0.100, "m"),
    "impact point, y": Span(-0.070, 0.070, "m"),
}
JOINT = "racket.throat_joint"
SPEED, RACKET_SPEED = 25.0, 15.0  # m/s: of the ball towards the racket; of the racket's share in it
OUTPUTS = ["ball_speed", "peak_hand_torque", "handle_ringing"]


def decision_sweep(design: SobolDesign, base: Scenario) -> Sweep:
    """The design's rows as cases: its five parameters set seven keys."""
    racket = load_racket(base.racket)
    moved = design.column("mass moved to the head")
    stiffness = design.column("frame stiffness")
    columns: dict[str, tuple[dict[str, Any], np.ndarray]] = {
        f"{JOINT}.out_of_plane_stiffness": ({"unit": "1", "relative": True}, stiffness),
        f"{JOINT}.in_plane_stiffness": ({"unit": "1", "relative": True}, stiffness),
        "tension": ({"unit": "N"}, design.column("stringing tension")),
        "racket.handle.mass": ({"unit": "kg"}, racket.handle.mass.value - moved),
        "racket.head.mass": ({"unit": "kg"}, racket.head.mass.value + moved),
        "offset_x": ({"unit": "m"}, design.column("impact point, x")),
        "offset_y": ({"unit": "m"}, design.column("impact point, y")),
    }
    keys = {name: settings for name, (settings, _) in columns.items()}
    rows = np.stack([values for _, values in columns.values()], axis=1).tolist()
    outputs = ["restitution", "peak_hand_torque", "handle_ringing"]
    return make_sweep(base, {"row": {"keys": keys, "rows": rows}}, outputs)


def with_ball_speed(dataset: xarray.Dataset) -> xarray.Dataset:
    """The dataset with the speed of the ball, if the racket moves at RACKET_SPEED."""
    e = dataset["restitution"]
    speed = e * (SPEED - RACKET_SPEED) + (1.0 + e) * RACKET_SPEED
    text = f"speed of the ball struck by a racket at {RACKET_SPEED:g} m/s"
    return dataset.assign(ball_speed=speed.assign_attrs(units="m/s", long_name=text))


def report(progress: Progress) -> None:
    """One line on a terminal, written over."""
    if sys.stderr.isatty():
        end = "\n" if progress.done == progress.total else ""
        text = f"\r{progress.task}: {progress.done} of {progress.total}"
        print(text, end=end, file=sys.stderr, flush=True)


def print_tables(indices: xarray.Dataset, dataset: xarray.Dataset) -> None:
    """Spans, spread of the outputs, and indices."""
    print("spans (inferred):")
    for name in indices["parameter"].to_numpy():
        at = indices.sel(parameter=name)
        print(f"  {name:24} {float(at['low']):g} to {float(at['high']):g} {at['unit'].item()}")
    for output in indices["output"].to_numpy():
        values = dataset[output]
        spread = f"{float(values.mean()):.4g} +- {float(values.std()):.3g} {values.attrs['units']}"
        print(f"{output.replace('_', ' ')}: {spread} (mean, standard deviation)")
        print("                             first order      total    (share of variance, +- 95 %)")
        for name in indices["parameter"].to_numpy():
            at = indices.sel(output=output, parameter=name)
            cells = "".join(
                f"   {float(at[n]):6.3f} +- {float(at[f'{n}_half_width']):.3f}"
                for n in ("first_order", "total")
            )
            print(f"  {name:24}{cells}")


def main() -> None:
    """Reads the options, runs the cases, prints and writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("what_decides_ball_speed"))
    parser.add_argument("--samples", type=int, default=1024, help="N, a power of 2; 7 N cases")
    parser.add_argument("--seed", type=int, default=1, help="of the design")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--fresh", action="store_true", help="delete what is in DIR/sweep")
    parser.add_argument("--quick", action="store_true", help="N = 4, short runs: no result")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    base = Scenario(
        support="grip",
        point="auto",
        speed=SPEED,
        approach_time=1e-4,
        after=0.008 if options.quick else 0.02,
        audit=False,
    )
    design = sobol_design(SPANS, 4 if options.quick else options.samples, options.seed)
    sweep = decision_sweep(design, base)
    directory = options.out / "sweep"
    dataset = run_sweep(
        sweep, directory, workers=options.workers, fresh=options.fresh, progress=report
    )
    dataset = with_ball_speed(dataset)
    indices = sobol_indices(design, dataset, OUTPUTS)
    print_tables(indices, dataset)
    write_netcdf(indices, options.out / "indices.nc")
    write_table(indices, options.out / "indices.csv")
    titles = {
        "ball_speed": "ball speed",
        "peak_hand_torque": "wrist load\n(peak torque on the hand)",
        "handle_ringing": "mid-handle vibration\n(RMS after release)",
    }
    write_figure(sensitivity_figure(indices, titles), options.out / "indices.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies.what_decides_ball_speed"):
        try:
            main()
        except KeyboardInterrupt:
            print("interrupted: finished cases are kept; the same call goes on", file=sys.stderr)
            sys.exit(130)
