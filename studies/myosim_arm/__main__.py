"""MyoSim's right arm, brought from MuJoCo into a Drake plant and compared with MuJoCo itself.

    pip install "drake-racket[mujoco]" myo-sim
    python -m studies.myosim_arm --out myosim_arm

Prints the degrees of freedom, the mass, what was left out, and the largest differences from MuJoCo.
Then the arm holds a racket, and a ball meets it at 25 m/s: 50 ms from touch, joints held by
constant torques. Leaves errors.nc and errors.csv (one row per random state), joints.nc and
joints.csv, and impact.nc, impact.csv and impact.png.
"""

import argparse
import warnings
from pathlib import Path

import numpy as np
import xarray
from pydrake.multibody.plant import MultibodyPlant

from drake_racket import (
    ImpactResult,
    InputError,
    LimbSettings,
    Scenario,
    Stroke,
    check_directory,
    impact_figure,
    make_impact_diagram,
    one_line_errors,
    simulate,
    write_csv,
    write_figure,
    write_netcdf,
    write_table,
)
from drake_racket.limbs import ImportedLimb, import_mujoco, quiet_mujoco
from studies.myosim_arm.compare import compare_with_mujoco, joint_table
from studies.myosim_arm.hand import HAND, fist, grip_in_hand

MODEL = "myoarm_r"
POSTURE = {"shoulder_elv_r": 60.0, "elv_angle_r": 60.0, "elbow_flexion_r": 40.0}  # degrees, chosen


def load_arm():
    """The compiled arm; the package builds it from its parts, which takes about a second."""
    try:
        import myo_sim
    except ImportError:
        raise InputError("myo_sim", "not installed", "pip install myo-sim") from None
    with quiet_mujoco(), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # on saving the assembled parts, which nobody does here
        return myo_sim.load_model(MODEL)


def print_arm(arm: ImportedLimb, errors: xarray.Dataset) -> None:
    """Degrees of freedom, mass, heaviest inertias, what is left out, and the differences."""
    model = arm.tree.model
    moving = [b for b in arm.tree.bodies if b.joints]
    print(f"{len(arm.joints)} degrees of freedom of {model.nv}: {', '.join(arm.joints)}")
    mass = sum(body.mass for body in arm.tree.bodies)
    print(f"total mass {mass:.4f} kg of {float(np.sum(model.body_mass)):.4f} kg in the model")
    print(f"{len(arm.locked)} joints locked; bodies with joints of more than 0.1 kg m^2:")
    for body in moving:
        moment = float(np.linalg.eigvalsh(body.I_BBcm_B)[-1])
        if moment > 0.1:
            print(f"  {body.name:14s} {moment:.3f} kg m^2, {body.mass:.3f} kg")
    print(f"\nleft out\n{arm.left_out.table()}\n")
    print(f"largest difference from MuJoCo in {errors.sizes['sample']} random states")
    for name, error in errors.data_vars.items():
        units = error.attrs["units"].replace("1", "relative")
        print(f"  {name:18s} {float(error.max()):.1e} {units}")


def strike(model, settings: dict, options: argparse.Namespace) -> ImpactResult:
    """A ball on the racket in the arm's hand."""

    def arm(plant: MultibodyPlant):
        return import_mujoco(plant, model, name=MODEL, **settings).limb

    # a posture, at rest: no place or motion of the racket is asked for
    limb = LimbSettings(joint_torques="hold", stroke=Stroke(guess_deg=POSTURE))
    scenario = Scenario(
        support="limb", limb=limb, grip_kind=options.grip_kind, after=options.after, audit=True
    )
    return simulate(scenario, make_impact_diagram(scenario, limb=arm))


def print_impact(result: ImpactResult) -> None:
    """What the ball and the arm did."""
    history = result.history
    turned = np.degrees(history["joint_position"][-1] - history["joint_position"][0])
    load = np.linalg.norm(history["hand_force"], axis=1)
    print(f"\nracket in the hand, ball at 25 m/s: restitution {result.apparent_restitution:.3f},")
    print(f"contact {1e3 * result.contact_time:.2f} ms, peak force on the hand {load.max():.0f} N")
    print(f"energy closes to {result.energy_error:.1e}; joints turned by, after the run (deg)")
    for name, angle in zip(history["joint"].to_numpy(), turned.to_numpy(), strict=True):
        print(f"  {name:18s} {angle:+6.1f}")


def main() -> None:
    """Reads the options, imports, compares, prints and writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("myosim_arm"), help="directory")
    parser.add_argument("--samples", type=int, default=100, help="random states to compare")
    parser.add_argument("--root", default=None, help="first body, such as clavicle_r; default all")
    parser.add_argument("--couplings", default="lock", help="lock or keep the tied shoulder joints")
    parser.add_argument("--fist", action="store_true", help="lock the fingers around a grip")
    parser.add_argument("--grip-kind", default="compliant", help="compliant, torsional or weld")
    parser.add_argument("--after", type=float, default=0.05, help="s simulated from touch on")
    options = parser.parse_args()
    if options.samples < 1:
        raise InputError("--samples", options.samples, "1 or more")
    check_directory(options.out, "--out")
    model = load_arm()
    how = {
        "root": options.root,
        "hand": HAND,
        "couplings": options.couplings,
        "locked": fist(model) if options.fist else {},
    }
    plant = MultibodyPlant(0.0)
    X_BH = grip_in_hand(model)
    arm = import_mujoco(plant, model, name=MODEL, X_BH=X_BH, **how)
    plant.Finalize()
    errors = compare_with_mujoco(model, samples=options.samples, **how)
    print_arm(arm, errors)
    axes = X_BH.rotation().matrix().T
    print(f"\nhand frame in {HAND}: at {np.round(1e3 * X_BH.translation(), 1)} mm")
    for letter, axis in zip("xyz", axes, strict=True):
        print(f"  {letter} along {np.round(axis, 3)}")
    held = {"root": "clavicle_r", "hand": HAND, "locked": fist(model), "X_BH": X_BH}
    result = strike(model, held, options)
    print_impact(result)
    options.out.mkdir(parents=True, exist_ok=True)
    write_netcdf(result.history, options.out / "impact.nc")
    write_csv(result.history, options.out / "impact.csv")
    write_figure(impact_figure(result.history), options.out / "impact.png")
    joints = joint_table(arm)
    write_netcdf(errors, options.out / "errors.nc")
    write_table(errors, options.out / "errors.csv")
    write_netcdf(joints, options.out / "joints.nc")
    write_table(joints, options.out / "joints.csv")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies.myosim_arm"):
        main()
