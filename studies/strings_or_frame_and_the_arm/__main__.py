"""Strings or frame: what changes the load on hand and arm more?

    python -m studies.strings_or_frame_and_the_arm --out strings_or_frame --workers 2

One thing at a time is changed of a racket in a hand (grip normal, inferred) that is hit at the
centre and towards the tip: the strings (tension, stiffness), the frame (stiffness, damping, 10 g of
lead), the grip (loose, tight). Kept are ball speed, contact time, peak
force and torque on the hand, and the ringing of the handle. Leaves the sweep (DIR/sweep), a table
(CSV) and a figure. The same call goes on where it stopped.
"""

import argparse
import sys
from pathlib import Path

from drake_racket import (
    Scenario,
    add_mass,
    check_directory,
    load_racket,
    one_line_errors,
    write_figure,
    write_racket,
    write_table,
)
from drake_racket.sweep import make_sweep, run_sweep
from studies.strings_or_frame_and_the_arm.figures import changes_figure
from studies.swings import report

STIFFNESS = "racket.throat_joint.out_of_plane_stiffness"
DAMPING = "racket.throat_joint.out_of_plane_damping"
T0 = "racket.string_bed.initial_tension"
STRINGS = [f"racket.string_bed.stiffness.k{i}" for i in range(1, 5)]
OUTPUTS = (
    "restitution",
    "contact_time",
    "peak_hand_force",
    "peak_hand_torque",
    "handle_ringing",
)


def changes(lead: str) -> dict[str, dict[str, object]]:
    """Name of a change -> keys and values; relative ones are factors.

    Args:
        lead: file of the racket with 10 g at 12 o'clock.

    """
    return {
        "as it is": {},
        "strings: tension -20 %": {T0: 0.8},
        "strings: tension +20 %": {T0: 1.2},
        "strings: half as stiff": dict.fromkeys(STRINGS, 0.5),
        "frame: stiffness -20 %": {STIFFNESS: 0.8},
        "frame: stiffness +20 %": {STIFFNESS: 1.2},
        "frame: ten times the damping": {DAMPING: 10.0},
        "frame: 10 g at 12 o'clock": {"racket": lead},
        "grip: loose": {"grip": "loose"},
        "grip: tight": {"grip": "tight"},
    }


def rows_of(
    table: dict[str, dict[str, object]], racket: str
) -> tuple[list[str], list[list[object]]]:
    """The sweep's keys, and one row of values a change."""
    loaded = load_racket(racket)
    joint, bed = loaded.throat_joint, loaded.string_bed
    nominal: dict[str, object] = {
        T0: bed.initial_tension.value,
        STIFFNESS: joint.out_of_plane()[0],
        DAMPING: joint.out_of_plane()[1],
        **dict(zip(STRINGS, bed.stiffness.value, strict=True)),
        "racket": racket,
        "grip": "normal",
    }
    rows = []
    for change in table.values():
        values = dict(nominal)
        for key, value in change.items():
            relative = key in (T0, STIFFNESS, DAMPING, *STRINGS)
            values[key] = float(nominal[key]) * value if relative else value  # type: ignore
        rows.append([values[key] for key in nominal])
    return list(nominal), rows


UNITS = {
    T0: "N",
    STIFFNESS: "N*m/rad",
    DAMPING: "N*m*s/rad",
    **dict.fromkeys(STRINGS, "N/m"),
}


def main() -> None:
    """Reads the options, runs the cases, prints and writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("strings_or_frame"))
    parser.add_argument("--racket", default="tour", help="a name, or a racket's file")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--fresh", action="store_true", help="delete what is in DIR/sweep")
    parser.add_argument("--quick", action="store_true", help="three changes, one point")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    options.out.mkdir(parents=True, exist_ok=True)
    lead = options.out / "with_lead.yaml"
    write_racket(add_mass(load_racket(options.racket), "10g", 12, name="with_lead"), lead)
    table = changes(str(lead))
    if options.quick:
        kept = ("as it is", "strings: tension -20 %", "frame: stiffness +20 %")
        table = {name: table[name] for name in kept}
    keys, rows = rows_of(table, options.racket)
    base = Scenario(
        support="grip",
        approach_time=1e-4,
        after=0.03,
        audit=False,
    )
    change = {
        "keys": {key: {"unit": UNITS[key]} if key in UNITS else {} for key in keys},
        "rows": rows,
        "labels": list(table),
    }
    axes = {"change": change, "point": [5] if options.quick else [5, 2]}
    sweep = make_sweep(base, axes, OUTPUTS)
    dataset = run_sweep(
        sweep, options.out / "sweep", workers=options.workers, fresh=options.fresh, progress=report
    )
    for point in dataset["point"].to_numpy():
        print(f"point {point}: change from the racket as it is, %")
        for name in list(table)[1:]:
            cells = []
            for output in OUTPUTS:
                values = dataset[output].sel(point=point)
                ratio = float(values.sel(change=name)) / float(values.sel(change="as it is"))
                cells.append(f"{output.replace('_', ' ')} {100.0 * (ratio - 1.0):+.1f}")
            print(f"  {name}: {', '.join(cells)}")
    kept_names = [name for name in dataset.data_vars if name in OUTPUTS]
    write_table(dataset[kept_names], options.out / "changes.csv")
    write_figure(changes_figure(dataset, OUTPUTS), options.out / "changes.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies.strings_or_frame_and_the_arm"):
        try:
            main()
        except KeyboardInterrupt:
            print("interrupted: finished cases are kept; the same call goes on", file=sys.stderr)
            sys.exit(130)
