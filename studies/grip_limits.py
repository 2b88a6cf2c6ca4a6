"""From the free racket to the welded one: a hand's stiffness, in a stroke of the shipped limb.

    python studies/grip_limits.py --out grip_limits

The backhand of data/backhand.yaml, struck at a corner of the string-bed, where the hold matters
most, with the normal compliant grip times factors from nearly nothing to nearly rigid. Prints,
writes (NetCDF, CSV) and draws the ball's rebound, the racket's rotation in the hand when the ball
has left, and the force on the hand, between their limits: no grip at all, and a weld. No torques
act on the joints.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray

from drake_racket import (
    ImpactResult,
    InputError,
    Output,
    Scenario,
    after_release,
    check_directory,
    data_directory,
    load_grip,
    load_scenario,
    one_line_errors,
    write_figure,
    write_grip,
    write_netcdf,
    write_table,
)
from drake_racket.plots import BLUE, GREY, new_figure, tidy
from drake_racket.sweep import make_sweep, run_grid

TITLE = "A hand from loose to rigid: corner impact in a backhand"
FACTORS = tuple(float(f) for f in np.logspace(-4, 6, 11))

CHECK = {"tolerance": 0.03}  # the largest force is that of a run's samples


def rebound(result: ImpactResult) -> float:
    """Normal velocity of the ball when it leaves."""
    return float(result.rebound_velocity[2])


def rotation(result: ImpactResult) -> float:
    """Angle of the racket in the hand at release."""
    assert result.history is not None
    return float(np.linalg.norm(after_release(result.history)["grip_angle"][0]))


def hand_force(result: ImpactResult) -> float:
    """Largest force on the hand."""
    assert result.history is not None
    return float(np.linalg.norm(result.history["hand_force"], axis=1).max())


OUTPUTS = (
    Output("rebound", "m/s", "normal rebound velocity of the ball", rebound, needs_history=True),
    Output(
        "rotation",
        "rad",
        "angle of the racket in the hand at release",
        rotation,
        needs_history=True,
    ),
    Output("hand_force", "N", "largest force on the hand", hand_force, needs_history=True),
)


def sweep(base: Scenario, factors: list[float]) -> xarray.Dataset:
    """The outputs over the factor; 0 is no grip at all, infinity a weld."""
    normal = load_grip("normal")
    with tempfile.TemporaryDirectory() as directory:
        paths = [str(Path(directory) / f"grip_{i}.yaml") for i in range(len(factors) + 1)]
        for path, factor in zip(paths, [0.0, *factors], strict=True):
            write_grip(normal.scaled(factor), Path(path))
        axes = {"grip": paths}
        compliant = make_sweep(replace(base, grip_kind="compliant"), axes, OUTPUTS, check=CHECK)
        held = run_grid(compliant, title=TITLE)
        kinds = {"grip_kind": ["weld"]}
        weld = run_grid(make_sweep(base, kinds, OUTPUTS, check=CHECK), title=TITLE)
    named = held.rename(grip="factor").assign_coords(factor=[0.0, *factors])
    last = weld.rename(grip_kind="factor").assign_coords(factor=[np.inf])
    dataset = xarray.concat([named, last], dim="factor", combine_attrs="override")
    dataset["factor"].attrs = {"units": "1", "long_name": "stiffness over the normal grip's"}
    return dataset


def figure(dataset: xarray.Dataset):
    """The three outputs over the factor, between the two limits."""
    drawn = new_figure(10.0, 3.6)
    inside = dataset.isel(factor=slice(1, -1))
    scales = {"rebound": 1.0, "rotation": 180.0 / np.pi, "hand_force": 1.0}
    labels = {
        "rebound": "normal rebound (m/s)",
        "rotation": "rotation in the hand at release (deg)",
        "hand_force": "largest force on the hand (N)",
    }
    for axes, (name, scale) in zip(drawn.subplots(1, 3), scales.items(), strict=True):
        axes.semilogx(inside["factor"], scale * inside[name], "o-", color=BLUE, label="grip")
        for at, style, text in ((0, ":", "no grip"), (-1, "--", "weld")):
            level = scale * float(dataset[name][at])
            axes.axhline(level, color=GREY, ls=style, label=text)
        axes.axvline(1.0, color="0.85", zorder=0)
        axes.set(xlabel="stiffness over the normal grip's (1)", ylabel=labels[name])
        tidy(axes)
    drawn.axes[0].legend(frameon=False, fontsize=8)
    drawn.suptitle(TITLE)
    return drawn


def main() -> None:
    """Reads the options, runs the cases, prints and writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("grip_limits"), help="output directory")
    parser.add_argument("--point", default="9", help="string-bed point")
    parser.add_argument("--factors", type=float, nargs="+", default=list(FACTORS))
    options = parser.parse_args()
    if sorted(set(options.factors)) != options.factors or not options.factors[0] > 0.0:
        raise InputError("--factors", options.factors, "rising numbers above 0")
    check_directory(options.out, "--out")
    base = load_scenario(data_directory() / "backhand.yaml")
    # no joint torques: what `hold` holds is another load for another grip
    limb = replace(base.limb, joint_torques="zero")
    base = replace(base, limb=limb, point=options.point, after=0.006, audit=False)
    dataset = sweep(base, options.factors)
    print("stiffness   rebound   in the hand   force on the hand")
    for factor in dataset["factor"].to_numpy():
        row = dataset.sel(factor=factor)
        print(
            f"{factor:9.4g}   {float(row['rebound']):7.4f}   {np.degrees(row['rotation']):8.4f} deg"
            f"   {float(row['hand_force']):9.1f} N"
        )
    options.out.mkdir(parents=True, exist_ok=True)
    write_netcdf(dataset, options.out / "grip_limits.nc")
    write_table(dataset, options.out / "grip_limits.csv")
    write_figure(figure(dataset), options.out / "grip_limits.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies/grip_limits.py"):
        main()
