"""Slow balls: which law of the ball's normal force falls with speed as balls do?

    python studies/slow_balls.py --out slow_balls

Fits the four constants of normal law `hunt_crossley` to the ITF's drop on a rigid floor and to what
the paper's linear ball does at the ends of its speeds, then compares three balls, on the floor and
on a clamped bed, down to a drop of 1 m. Prints the constants with residuals; leaves NetCDF and a
figure.
"""

import argparse
import dataclasses
from pathlib import Path

import numpy as np
import xarray
from matplotlib.figure import Figure
from scipy.optimize import least_squares

from drake_racket import (
    BallParameters,
    Scenario,
    check_directory,
    load_ball,
    one_line_errors,
    simulate,
    write_figure,
    write_netcdf,
)
from drake_racket.plots import BLUE, GREEN, VERMILION, new_figure, tidy
from drake_racket.rigs import plate_dataset

ITF_SPEED, ITF_MIDDLE, ITF_HALF = 7.058, 0.745, 0.016
"""m/s after 100 inches without air; restitution of a rebound of 135 to 147 cm, and half its range
(ITF Rules of Tennis, Appendix I)."""
ENDS = 18.0, 33.0  # m/s, of the paper's cannon
TIME_SHARE = 0.05  # of a contact time, that weighs as much as ITF_HALF of restitution
SPEEDS = (1.0, 2.0, 4.43, ITF_SPEED, 10.0, 14.0, 18.0, 22.0, 25.5, 29.0, 33.0)
BED_SPEEDS = (4.43, ITF_SPEED, 10.0, 14.0, 18.0, 25.5, 33.0)
NAMES = ("stiffness", "stiffness_rise", "damping", "damping_rise")
UNITS = np.array([2e4, 2e6, 1.0, 2000.0])
BALLS = {
    "linear": {},
    "penn_titanium_slow": {"ball": "penn_titanium_slow"},
    "hunt_crossley": {"normal": "hunt_crossley"},
}


def stiffening_ball(constants: np.ndarray) -> BallParameters:
    """The shipped ball with normal law hunt_crossley and these constants (SI)."""
    ball = load_ball(normal="hunt_crossley")
    assert ball.hunt_crossley is not None
    own = {
        name: dataclasses.replace(getattr(ball.hunt_crossley, name), value=float(value))
        for name, value in zip(NAMES, constants, strict=True)
    }
    return dataclasses.replace(ball, hunt_crossley=dataclasses.replace(ball.hunt_crossley, **own))


def residuals(constants: np.ndarray) -> np.ndarray:
    """Five numbers: restitution of the drop; restitution and contact time at both ends."""
    linear = plate_dataset(ENDS)
    ours = plate_dataset((ITF_SPEED, *ENDS), stiffening_ball(constants))
    restitution = ours["restitution"].to_numpy()
    fall = (restitution[1:] - linear["restitution"].to_numpy()) / ITF_HALF
    times = ours["contact_time"].to_numpy()[1:] / linear["contact_time"].to_numpy() - 1.0
    return np.array([(restitution[0] - ITF_MIDDLE) / ITF_HALF, *fall, *times / TIME_SHARE])


def fitted() -> tuple[np.ndarray, np.ndarray]:
    """The constants (SI), from the shipped ones on, and their residuals."""
    shipped = load_ball().hunt_crossley
    assert shipped is not None
    start = np.array([getattr(shipped, name).value for name in NAMES]) / UNITS
    found = least_squares(lambda x: residuals(UNITS * x), start, bounds=(1e-6, np.inf))
    return UNITS * found.x, found.fun


def balls_dataset() -> xarray.Dataset:
    """Restitution of the balls on the floor and on the tour racket's clamped bed, over speed."""
    floor, bed = [], []
    for changes in BALLS.values():
        scenario = Scenario(support="clamped_head", after=0.02, engine="compiled", **changes)
        floor.append(plate_dataset(SPEEDS, scenario.load_ball())["restitution"].to_numpy())
        bed.append(
            [
                simulate(dataclasses.replace(scenario, speed=v), history=False).apparent_restitution
                for v in BED_SPEEDS
            ]
        )
    return xarray.Dataset(
        {
            "floor": (("ball", "speed"), np.array(floor), {"units": "1"}),
            "bed": (("ball", "bed_speed"), np.array(bed), {"units": "1"}),
        },
        coords={
            "ball": list(BALLS),
            "speed": ("speed", list(SPEEDS), {"units": "m/s"}),
            "bed_speed": ("bed_speed", list(BED_SPEEDS), {"units": "m/s"}),
        },
        attrs={"title": "restitution on a rigid floor and on a clamped bed"},
    )


def restitution_figure(dataset: xarray.Dataset) -> Figure:
    """Both restitutions over speed, with the published numbers."""
    figure = new_figure(9.0, 3.9)
    axes = figure.subplots(1, 2, sharey=True)
    for ball, colour in zip(BALLS, (VERMILION, GREEN, BLUE), strict=True):
        for ax, name, speed in zip(axes, ("floor", "bed"), ("speed", "bed_speed"), strict=True):
            values = dataset[name].sel(ball=ball)
            ax.plot(dataset[speed], values, "o-", ms=3, color=colour, label=ball)
    axes[0].errorbar(ITF_SPEED, ITF_MIDDLE, ITF_HALF, color="black", capsize=3, label="ITF")
    axes[1].errorbar(ITF_SPEED, 0.915, 0.015, color="black", capsize=3, label="Korte 1992")
    axes[1].plot(4.43, 0.84, "kx", label="Cross")
    axes[0].set_ylabel("restitution")
    for ax, title in zip(axes, ("rigid floor", "clamped bed, centre"), strict=True):
        ax.set_title(title)
        ax.set_xlabel("speed (m/s)")
        ax.legend(frameon=False, fontsize=8)
        tidy(ax)
    return figure


def main() -> None:
    """Fits, compares, prints and writes."""
    parser = argparse.ArgumentParser(description="Laws of the ball's normal force, slow and fast.")
    parser.add_argument("--out", type=Path, default=Path("slow_balls"), help="directory")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    options.out.mkdir(parents=True, exist_ok=True)
    constants, left = fitted()
    print(", ".join(f"{n} {v:.5g}" for n, v in zip(NAMES, constants, strict=True)))
    print("residuals (1: the ITF's half range, 5 % of a time):", np.round(left, 2).tolist())
    dataset = balls_dataset()
    for name, speed in (("floor", "speed"), ("bed", "bed_speed")):
        print(name, dataset[speed].to_numpy().tolist())
        for ball in BALLS:
            print(f"  {ball:20s}", dataset[name].sel(ball=ball).round(3).to_numpy().tolist())
    write_netcdf(dataset, options.out / "balls.nc")
    write_figure(restitution_figure(dataset), options.out / "restitution.png")


if __name__ == "__main__":
    with one_line_errors("studies/slow_balls.py"):
        main()
