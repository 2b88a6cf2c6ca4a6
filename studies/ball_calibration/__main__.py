"""Which kb and cb at 18 m/s agree with the published bounds, as a map with the default on it.

    python -m studies.ball_calibration --out ball_calibration

Leaves NetCDF and a figure.
"""

import argparse
from pathlib import Path

import numpy as np

from drake_racket import check_directory, load_ball, one_line_errors, write_figure, write_netcdf
from studies.ball_calibration.calibration import (
    DAMPINGS,
    STIFFNESSES,
    Bounds,
    calibration_dataset,
    nearest,
    tolerance_needed,
)
from studies.ball_calibration.figures import calibration_figure


def main() -> None:
    """Reads the options, computes, prints and writes."""
    ball = load_ball()
    parser = argparse.ArgumentParser(description="Map of kb and cb at 18 m/s.")
    parser.add_argument("--out", type=Path, default=Path("ball_calibration"), help="directory")
    parser.add_argument("--kb", type=float, nargs="+", default=list(STIFFNESSES), help="N/m")
    parser.add_argument("--cb", type=float, nargs="+", default=list(DAMPINGS), help="N s/m")
    parser.add_argument("--tolerance", type=float, default=Bounds().tolerance, help="of the range")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    bounds = Bounds(tolerance=options.tolerance)
    if min(len(options.kb), len(options.cb)) < 2:
        parser.error("a map needs two values of --kb and of --cb")
    dataset = calibration_dataset(stiffnesses=options.kb, dampings=options.cb, bounds=bounds)
    default = calibration_dataset(
        stiffnesses=[ball.stiffness_low.value], dampings=[ball.damping_low.value], bounds=bounds
    )
    report("default", default.isel(kb=0, cb=0), default)
    best = nearest(dataset)
    report("nearest to the rebound range, all other bounds kept", best, dataset)
    kept = dataset["agrees"].sel(bound="all of the source")
    print(f"\n{int(kept.sum())} of {kept.size} places keep all bounds of the source")
    if int(kept.sum()):
        i, j = np.nonzero(kept.to_numpy())
        kb, cb = 1e-3 * dataset["kb"].to_numpy()[i], dataset["cb"].to_numpy()[j]
        print(f"  kb {kb.min():g}-{kb.max():g} kN/m, cb {cb.min():g}-{cb.max():g} N s/m")
    options.out.mkdir(parents=True, exist_ok=True)
    write_netcdf(dataset, options.out / "ball_calibration.nc")
    write_figure(calibration_figure(dataset), options.out / "ball_calibration.png")
    print(f"wrote {options.out}")


def report(title, place, dataset) -> None:
    """Prints what one place of the map gives."""
    miss = float(tolerance_needed(dataset).sel(kb=place["kb"], cb=place["cb"]))
    print(f"\n{title}: kb {1e-3 * float(place['kb']):g} kN/m, cb {float(place['cb']):g} N s/m")
    for bed in place["bed"].to_numpy():
        one = place.sel(bed=bed)
        low, high = float(one["rebound_low"]), float(one["rebound_high"])
        print(f"  {bed:20} rebound {low:6.2f} to {high:6.2f} m/s")
    print(f"  rebound range missed by {100 * miss:.1f} %")
    force, time = 1e-3 * float(place["peak_force"]), 1e3 * float(place["contact_time"])
    print(f"  plate, 33 m/s: peak {force:.2f} kN, restitution {float(place['restitution']):.3f}")
    print(f"  plate, longest contact {time:.2f} ms")
    print(f"  ITF drop: restitution {float(place['drop_restitution']):.3f}")
    for bound in place["bound"].to_numpy():
        print(f"  {bound:30} {'kept' if int(place['agrees'].sel(bound=bound)) else 'not kept'}")


if __name__ == "__main__":
    with one_line_errors("studies.ball_calibration"):
        main()
