"""A laboratory without a laboratory: data files with known truth, in the form of your own.

    python -m studies.synthetic_laboratory --out synthetic_laboratory --racket tour --seed 1

Writes what the source's experiments measure, made by the model with the source's errors: impacts
on a force plate, strikes with an impact hammer, restitution of normal impacts and rebound angles
of oblique ones on the clamped head. `drake-racket identify` reads the files. The parameters behind
them are those of the racket and the ball given; `truth.csv` and the NetCDF files have what the
measured values hide.
"""

import argparse
from pathlib import Path

import numpy as np

from drake_racket import (
    BallParameters,
    InputError,
    RacketParameters,
    check_directory,
    load_ball,
    load_racket,
    one_line_errors,
    write_netcdf,
    write_text,
)
from drake_racket.engines import bed_parameters
from drake_racket.rigs import ANGLE_READINGS, CANNON_SPEEDS, DIRECTIONS
from studies.synthetic_laboratory import laboratory as lab
from studies.synthetic_laboratory import records


def parse() -> argparse.Namespace:
    """The command line."""
    default = lab.Noise()
    parser = argparse.ArgumentParser(description="Synthetic measurements, with known truth.")
    parser.add_argument("--out", type=Path, default=Path("synthetic_laboratory"), help="directory")
    parser.add_argument("--racket", default="tour", help="tour, recreational, or a YAML file")
    parser.add_argument("--tension", default="low", help="low, high, or N")
    parser.add_argument("--ball", default="penn_titanium", help="name or YAML file")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--repeats", type=int, default=lab.REPEATS, help="at each place and speed")
    parser.add_argument("--speeds", type=float, nargs="+", default=list(CANNON_SPEEDS), help="m/s")
    parser.add_argument("--strikes", type=int, default=3, help="of the hammer in each direction")
    parser.add_argument(
        "--angle-reading", choices=ANGLE_READINGS, default="from_plane", help="oblique impacts"
    )
    parser.add_argument(
        "--friction-reading", choices=("velocity", "displacement"), default="velocity"
    )
    parser.add_argument("--speed-error", type=float, default=default.speed, help="m/s")
    parser.add_argument("--reading", choices=lab.READINGS, default=default.reading)
    parser.add_argument("--scatter", type=float, default=default.scatter, help="of the cannon, m/s")
    parser.add_argument(
        "--angle-error", type=float, help="deg; from the speeds' error if not given"
    )
    parser.add_argument(
        "--force-error", type=float, default=default.force, help="share of the peak"
    )
    parser.add_argument(
        "--acceleration-error", type=float, default=default.acceleration, help="share of the peak"
    )
    return parser.parse_args()


def truth(racket: RacketParameters, ball: BallParameters) -> str:
    """CSV: the parameters that the fits should find."""
    names, values = bed_parameters(racket)
    units = {"T": "N", "k": "N/m", "p": "1"}
    rows = [(n, units[n[0]], float(x)) for n, x in zip(names, values, strict=True)]
    mu = racket.friction.coefficients.value
    rows += [(f"mu{i + 1}", "1", float(x)) for i, x in enumerate(mu)]
    for direction in DIRECTIONS:
        kf, cf = getattr(racket.throat_joint, direction)()
        rows += [(f"kf {direction}", "N*m/rad", kf), (f"cf {direction}", "N*m*s/rad", cf)]
    for name in ("speed_low", "speed_high", "stiffness_low", "stiffness_growth"):
        rows.append((name, getattr(ball, name).unit, float(getattr(ball, name).value)))
    for name in ("damping_low", "damping_growth"):
        rows.append((name, getattr(ball, name).unit, float(getattr(ball, name).value)))
    return "\n".join(["parameter,unit,value", *(f"{n},{u},{x!r}" for n, u, x in rows), ""])


def main() -> None:
    """Makes the measurements and writes them."""
    options = parse()
    check_directory(options.out, "--out")
    if options.seed < 0:
        raise InputError("--seed", options.seed, "0 or more")
    racket, ball = load_racket(options.racket, options.tension), load_ball(options.ball)
    noise = lab.Noise(
        speed=options.speed_error,
        reading=options.reading,
        scatter=options.scatter,
        angle=None if options.angle_error is None else float(np.radians(options.angle_error)),
        force=options.force_error,
        acceleration=options.acceleration_error,
    )
    # a stream for each experiment: one does not change with the others' size
    streams = np.random.default_rng(options.seed).spawn(4)
    many = {"repeats": options.repeats, "noise": noise}
    plate = records.plate_impacts(ball, streams[0], speeds=options.speeds, **many)
    strikes = {
        direction: records.hammer_strikes(
            racket, direction, streams[1], strikes=options.strikes, noise=noise
        )
        for direction in DIRECTIONS
    }
    normal = lab.restitution_table(racket, ball, streams[2], speeds=options.speeds, **many)
    oblique = lab.oblique_table(
        racket,
        ball,
        streams[3],
        angle_readings=[options.angle_reading],
        friction_reading=options.friction_reading,
        **many,
    )
    out = options.out
    out.mkdir(parents=True, exist_ok=True)
    records.write_plate_impacts(plate, out / "force_plate")
    (out / "hammer").mkdir(exist_ok=True)
    for pairs in strikes.values():
        for pair in pairs:
            records.write_hammer_strike(pair, out / "hammer" / f"{pair[0].where}.csv")
    lab.write_measurements(normal, lab.RESTITUTION_COLUMNS, out / "restitution.csv")
    lab.write_measurements(oblique, lab.OBLIQUE_COLUMNS, out / "oblique.csv")
    write_netcdf(normal, out / "restitution_with_truth.nc")
    write_netcdf(oblique, out / "oblique_with_truth.nc")
    write_text(truth(racket, ball), out / "truth.csv")
    print(f"{racket.title}; {ball.title}; seed {options.seed}")
    for name, count, what in (
        ("force_plate/impacts.csv", len(plate), "impacts, a record each"),
        ("hammer/", sum(map(len, strikes.values())), "strikes"),
        ("restitution.csv", normal.sizes["impact"], "normal impacts"),
        ("oblique.csv", oblique.sizes["impact"], "oblique impacts"),
        ("truth.csv", truth(racket, ball).count("\n") - 1, "parameters behind them"),
    ):
        print(f"  {name:24s}{count:5d} {what}")
    print("  restitution as measured, mean over points and repeats:")
    measured = normal["restitution"].to_numpy()
    for speed in options.speeds:
        at_speed = measured[normal["nominal_speed"].to_numpy() == speed]
        print(f"    {speed:4.1f} m/s  {at_speed.mean():.4f}")
    print(f"wrote {out}")


if __name__ == "__main__":
    with one_line_errors("studies.synthetic_laboratory"):
        main()
