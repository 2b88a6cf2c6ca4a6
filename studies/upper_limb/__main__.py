"""The shipped upper limb: its table of numbers, and a picture of its joints and frames.

    python -m studies.upper_limb --out upper_limb --mass 80 --height 1.85 --side left

The picture's first row shows all joints at zero and which way each turns when it is positive; its
second row shows the posture of `--posture-deg` with the hand frame, on which a racket's grip lies.
"""

import argparse
from pathlib import Path

import numpy as np
from pydrake.multibody.plant import MultibodyPlant

from drake_racket import (
    JOINTS,
    check_directory,
    load_upper_limb,
    one_line_errors,
    write_figure,
    write_netcdf,
    write_table,
)
from drake_racket.limbs import GRIP_ROTATIONS, add_upper_limb
from studies.upper_limb.figures import upper_limb_figure
from studies.upper_limb.posture import limb_posture, segment_dataset, set_posture

# an example, not a measured one: racket level and out to the side, strings facing forward
FOREHAND_DEG = (45.0, 40.0, -45.0, 15.0, -35.0, -50.0, -30.0)


def main() -> None:
    """Prints the table; writes the data and the picture."""
    parser = argparse.ArgumentParser(description="Table and picture of the shipped upper limb.")
    parser.add_argument("--out", type=Path, default=Path("upper_limb"), help="output directory")
    parser.add_argument("--mass", type=float, help="the subject's mass (kg)")
    parser.add_argument("--height", type=float, help="the subject's height (m)")
    parser.add_argument("--side", default="right", help="right or left")
    parser.add_argument("--grip", default="eastern_forehand", choices=GRIP_ROTATIONS)
    parser.add_argument(
        "--posture-deg",
        type=float,
        nargs=7,
        default=FOREHAND_DEG,
        metavar="ANGLE",
        help="joint angles of the second row, in degrees, from shoulder to hand",
    )
    arguments = parser.parse_args()
    check_directory(arguments.out, "--out")
    parameters = load_upper_limb(mass=arguments.mass, height=arguments.height)
    plant = MultibodyPlant(0.0)
    limb = add_upper_limb(
        plant, parameters, side=arguments.side, grip_rotation=GRIP_ROTATIONS[arguments.grip]
    )
    plant.Finalize()
    context = plant.CreateDefaultContext()
    zero = limb_posture(limb, context)
    set_posture(limb, context, np.radians(arguments.posture_deg))
    posture = limb_posture(limb, context)
    segments = segment_dataset(parameters)

    subject = parameters.subject
    print(f"{parameters.title}: {subject.mass.value:g} kg, {subject.height.value:g} m")
    print(f"{'segment':10} {'mass':>8} {'length':>8} {'COM':>8}   moments of inertia about the COM")
    for name in segments["segment"].to_numpy():
        row = segments.sel(segment=name)
        moments = [row[f"moi_{axis}"].item() for axis in ("sagittal", "transverse", "longitudinal")]
        print(
            f"{name:10} {row['mass'].item():5.3f} kg {1e3 * row['length'].item():5.1f} mm"
            f" {1e3 * row['com'].item():5.1f} mm   sagittal {moments[0]:.5f},"
            f" transverse {moments[1]:.5f}, longitudinal {moments[2]:.5f} kg m^2"
        )
    print(f"{'joint':20} {'range':>16} {'posture':>10}")
    for joint in JOINTS:
        row = posture.sel(joint=joint)
        low, high, angle = (
            np.degrees(row[f"joint_{key}"].item()) for key in ("lower", "upper", "position")
        )
        print(f"{joint:20} {low:5.0f} to {high:4.0f} deg {angle:6.1f} deg")
    hand = posture.sel(frame="hand")
    place = ", ".join(f"{x:+.3f}" for x in hand["frame_origin"].to_numpy())
    print(f"grip centre in the shoulder frame (forward, left, up): {place} m")

    arguments.out.mkdir(parents=True, exist_ok=True)
    write_table(segments, arguments.out / "segments.csv")
    write_netcdf(posture, arguments.out / "posture.nc")
    angles = ", ".join(f"{a:g}" for a in arguments.posture_deg)
    title = (
        f"Upper limb, {arguments.side}, {arguments.grip.replace('_', ' ')}; posture {angles} deg"
    )
    write_figure(upper_limb_figure(zero, posture, title), arguments.out / "upper_limb.png")
    print(f"wrote segments.csv, posture.nc and upper_limb.png in {arguments.out}")


if __name__ == "__main__":
    with one_line_errors("studies.upper_limb"):
        main()
