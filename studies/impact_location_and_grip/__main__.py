"""Where the ball hits and how tight the grip is: a one-handed backhand at nine points, three grips.

    python -m studies.impact_location_and_grip --out impact_location_and_grip --workers 2

After King, Kentel & Mitchell (2012), J. Biomech. 45:1048-1052; the stroke is data/backhand.yaml.
Leaves the histories (NetCDF), a table and the verdicts (CSV), and figures. Each finished run stays
in DIR/runs.sqlite: a call that was interrupted goes on where it stopped.
"""

import argparse
import csv
import dataclasses
import io
import sys
from pathlib import Path

import numpy as np
import xarray

from drake_racket import (
    GRIPS,
    JOINT_TORQUES,
    Progress,
    changed,
    check_directory,
    one_line_errors,
    write_figure,
    write_netcdf,
    write_table,
    write_text,
)
from drake_racket.laws import POINT_NUMBERS
from studies.impact_location_and_grip.figures import (
    grip_histories,
    joint_histories,
    load_histories,
    location_maps,
)
from studies.impact_location_and_grip.findings import (
    Finding,
    findings,
    mean_load,
    points_below,
    summary,
)
from studies.impact_location_and_grip.runs import backhand_scenario, grip_and_location


def main() -> None:
    """Reads the options, runs the rig, prints and writes."""
    parser = argparse.ArgumentParser(description="Impact location and grip tightness, backhand.")
    parser.add_argument("--out", type=Path, default=Path("impact_location_and_grip"))
    parser.add_argument("--points", type=int, nargs="+", default=list(POINT_NUMBERS))
    parser.add_argument(
        "--grips", nargs="+", default=list(GRIPS), help="loose, normal, tight, or YAML files"
    )
    parser.add_argument("--joint-torques", default="hold", choices=JOINT_TORQUES)
    parser.add_argument(
        "--activation", type=float, default=0.0, help="of the joints' muscles, 0 to 1"
    )
    parser.add_argument("--racket", default="tour", help="tour, recreational, or a YAML file")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--after", type=float, default=0.05, help="time simulated from touch (s)")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    base = backhand_scenario()
    limb = dataclasses.replace(
        base.limb, joint_torques=options.joint_torques, activation=options.activation
    )
    base = changed(base, limb=limb, racket=options.racket, after=options.after)

    def progress(now: Progress) -> None:
        print(f"{now.done} of {now.total} runs", file=sys.stderr)

    data = grip_and_location(
        base=base,
        grips=options.grips,
        points=options.points,
        store=options.out / "runs.sqlite",
        workers=options.workers,
        progress=progress,
    )
    table, found = summary(data), findings(data)
    write_netcdf(data, options.out / "grip_and_location.nc")
    write_table(table, options.out / "points.csv")
    write_verdicts(found, options.out / "verdicts.csv")
    write_figure(location_maps(data, options.racket), options.out / "maps.png")
    write_figure(grip_histories(data), options.out / "grips.png")
    for grip in options.grips:
        name = Path(grip).stem
        write_figure(joint_histories(data, grip), options.out / f"joints_{name}.png")
        write_figure(load_histories(data, grip), options.out / f"loads_{name}.png")
    print_table(data, table)
    for finding in found:
        print(f"{finding.verdict()}: {sentence(finding)}")
    print(f"wrote {options.out}")


_HEADER = """\
       height   wrist flexed    load flexing the wrist   largest turn    ball's
point  over     by the impact   at most   mean of the    of the racket   rebound
       axis     in 30 ms                  first 30 ms    in the hand     speed
       mm       deg             N m       N m            deg             m/s"""


def print_table(data: xarray.Dataset, table: xarray.Dataset) -> None:
    """A line per grip and point."""
    below = ", ".join(map(str, points_below(data))) or "none"
    print(f"points below the racket's long axis: {below}")
    print(_HEADER)
    for grip in data["grip"].to_numpy():
        swing = np.degrees(data["swing_joint_position"].sel(grip=grip, joint="wrist_flexion"))
        moved = float(swing[-1] - swing[0])
        print(f"{grip} grip (without impact the wrist flexes {moved:.1f} deg to the end)")
        for point in data["point"].to_numpy():
            row = table.sel(grip=grip, point=point)
            mean = float(mean_load(data).sel(grip=grip, point=point))
            print(
                f"{point:3}   {1e3 * float(row['height']):+7.1f}"
                f"  {float(row['flexion_by_impact_30ms']):8.1f}"
                f"  {float(row['wrist_flexion_peak_flexing_load']):14.1f}  {mean:+9.2f}"
                f"  {float(row['peak_grip_rotation']):14.1f}"
                f"  {float(row['rebound_speed']):15.2f}"
            )


def sentence(finding: Finding) -> str:
    """A finding in one line."""
    unit = "" if finding.unit == "1" else f" {finding.unit}"
    model = "no number" if finding.model is None else f"{finding.model:.3g}{unit}"
    return f"{finding.quantity}: {model}; published: {finding.published} ({finding.source})"


def write_verdicts(found: list[Finding], path: Path) -> None:
    """One line per statement."""
    text = io.StringIO()
    names = [f.name for f in dataclasses.fields(Finding)]
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*names, "verdict"])
    for finding in found:
        writer.writerow([*(getattr(finding, name) for name in names), finding.verdict()])
    write_text(text.getvalue(), path)


if __name__ == "__main__":
    kept = "the finished runs are kept: the same call goes on"
    with one_line_errors("studies.impact_location_and_grip", kept=kept):
        main()
