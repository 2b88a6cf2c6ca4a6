"""What a stiffer or more damped frame does to ball speed and to the handle's vibration.

    python -m studies.frame_stiffness_and_handle_vibration --out frame_stiffness --workers 2

The tour racket's out-of-plane stiffness and damping at the throat joint, as factors (inferred
ranges), at three points of the long axis; free, and in a hand (grip normal, inferred). Vibration is
the RMS of mid-handle's acceleration after release. Leaves the sweep (DIR/sweep) and a figure. The
same call goes on where it stopped.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
import xarray

from drake_racket import (
    IntegratorSettings,
    Progress,
    Scenario,
    apply_overrides,
    check_directory,
    frame_fundamentals,
    load_racket,
    one_line_errors,
    write_figure,
    write_netcdf,
)
from drake_racket.sweep import make_sweep, run_sweep
from studies.sample_figures import frame_figure

STIFFNESS = "racket.throat_joint.out_of_plane_stiffness"
DAMPING = "racket.throat_joint.out_of_plane_damping"


def fundamentals(racket_name: str, factors: np.ndarray) -> xarray.DataArray:
    """Out-of-plane fundamental (Hz) of the free, bare frame over the stiffness factor."""
    racket = load_racket(racket_name)
    value = racket.throat_joint.out_of_plane()[0]
    found = [
        frame_fundamentals(apply_overrides(racket, {STIFFNESS: float(f) * value}))[1]
        for f in factors
    ]
    attributes = {"units": "Hz", "long_name": "out-of-plane fundamental of the free, bare frame"}
    return xarray.DataArray(found, dims="stiffness", attrs=attributes)


def report(progress: Progress) -> None:
    """One line on a terminal, written over."""
    if sys.stderr.isatty():
        end = "\n" if progress.done == progress.total else ""
        text = f"\r{progress.task}: {progress.done} of {progress.total}"
        print(text, end=end, file=sys.stderr, flush=True)


def print_table(dataset: xarray.Dataset) -> None:
    """Rebound and ringing over stiffness, at the shipped damping; then over damping."""
    print("support  point  stiffness  damping  fundamental  rebound    mid-handle after release")
    for support in dataset["support"].to_numpy():
        for point in dataset["point"].to_numpy():
            for k, c in np.ndindex(dataset.sizes["stiffness"], dataset.sizes["damping"]):
                case = dataset.sel(support=support, point=point).isel(stiffness=k, damping=c)
                print(
                    f"{support:8} {point:5}  {float(case['stiffness']):5.2f} x"
                    f"  {float(case['damping']):7.3g} x {float(case['fundamental']):8.1f} Hz"
                    f"  {float(case['rebound_speed']):6.2f} m/s"
                    f"  {float(case['handle_ringing']):8.0f} m/s^2"
                )


def main() -> None:
    """Reads the options, runs the cases, prints and writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("frame_stiffness"))
    parser.add_argument("--racket", default="tour", help="tour, recreational, or a YAML file")
    parser.add_argument("--points", type=int, nargs="+", default=[2, 5, 8])
    parser.add_argument("--stiffness", type=float, nargs="+", default=[0.5, 0.7, 1.0, 1.4, 2.0])
    parser.add_argument("--damping", type=float, nargs="+", default=[1.0, 3.0, 10.0])
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--fresh", action="store_true", help="delete what is in DIR/sweep")
    parser.add_argument("--quick", action="store_true", help="two frames, one point, a short run")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    base = Scenario(
        racket=options.racket,
        approach_time=1e-4,
        after=0.008 if options.quick else 0.03,
        audit=False,
        integrator=IntegratorSettings(accuracy=2e-2),  # moves the ringing by less than 1 %
    )
    factors = [1.0, 2.0] if options.quick else options.stiffness
    dampings = options.damping[:1] if options.quick else options.damping
    relative = {"relative": True, "unit": "1"}
    sweep = make_sweep(
        base,
        {
            "support": ["free"] if options.quick else ["free", "grip"],
            "point": options.points[:1] if options.quick else options.points,
            "stiffness": {"key": STIFFNESS, "values": factors, **relative},
            "damping": {"key": DAMPING, "values": dampings, **relative},
        },
        ["restitution", "rebound_speed", "handle_ringing", "peak_out_of_plane_angle"],
    )
    directory = options.out / "sweep"
    dataset = run_sweep(
        sweep, directory, workers=options.workers, fresh=options.fresh, progress=report
    )
    frequencies = fundamentals(options.racket, dataset["stiffness"].to_numpy())
    dataset = dataset.assign(fundamental=frequencies)
    print_table(dataset)
    write_netcdf(dataset, options.out / "frame.nc")
    write_figure(frame_figure(dataset), options.out / "frame.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies.frame_stiffness_and_handle_vibration"):
        try:
            main()
        except KeyboardInterrupt:
            print("interrupted: finished cases are kept; the same call goes on", file=sys.stderr)
            sys.exit(130)
