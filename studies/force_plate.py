"""The ball on a force plate at 18-33 m/s, and a measured force signal read the same way.

    python studies/force_plate.py --out force_plate
    python studies/force_plate.py --out force_plate --signal plate.csv --approach-speed 27

Prints and writes contact time, peak force, restitution, kb and cb at each speed, beside the closed
form of the damped oscillator. A signal is a CSV with the columns `time [s]` and `force [N]`.
"""

import argparse
from pathlib import Path

from drake_racket import (
    InputError,
    Signal,
    check_directory,
    load_ball,
    one_line_errors,
    read_signal,
    write_csv,
    write_figure,
    write_netcdf,
    write_table,
)
from drake_racket.plots import force_plate_figure
from drake_racket.rigs import CANNON_SPEEDS, PLATE_SAMPLE_RATE, analyse_force, plate_dataset

LONGEST_STEP = 250e-6  # s: 20 samples in 5 ms, the whole axis of the source's Fig. 4


def main() -> None:
    """Runs the study."""
    parser = argparse.ArgumentParser(description="The ball on a rigid force plate.")
    parser.add_argument("--out", type=Path, default=Path("force_plate"), help="output directory")
    parser.add_argument("--speeds", type=float, nargs="+", default=list(CANNON_SPEEDS), help="m/s")
    parser.add_argument("--ball", default="penn_titanium", help="name, or a YAML file")
    parser.add_argument("--rate", type=float, default=PLATE_SAMPLE_RATE, help="of the samples, Hz")
    parser.add_argument("--signal", type=Path, help="CSV with time [s] and force [N]")
    parser.add_argument("--approach-speed", type=float, help="of the ball in the signal, m/s")
    parser.add_argument("--threshold", type=float, default=0.01, help="of contact, share of peak")
    options = parser.parse_args()
    check_directory(options.out, "--out")

    ball = load_ball(options.ball)
    if (options.signal is None) != (options.approach_speed is None):
        raise InputError("--signal, --approach-speed", "only one of them", "both or neither")
    measured = None
    if options.signal is not None:
        signal = read_signal(options.signal, "force", "N", longest_step=LONGEST_STEP)
        numbers = {"mass": ball.mass.value, "approach_speed": options.approach_speed}
        found = analyse_force(signal, **numbers, threshold=options.threshold)
        measured = Signal(signal.time - found.start, signal.value, "force", "N", signal.where)
    data = plate_dataset(options.speeds, ball, rate=options.rate)

    print("speed    kb      cb      contact  peak    at      restitution  rebound  closed form:")
    print(
        "m/s      kN/m    N s/m   ms       N       ms                   m/s      largest difference"
    )
    for speed in data["speed"].to_numpy():
        case = data.sel(speed=speed)
        names = ("contact_time", "peak_force", "restitution", "impulse")
        error = max(abs(float(case[n] / case[f"{n}_closed_form"]) - 1.0) for n in names)
        print(
            f"{speed:5.1f}    {case['kb'] / 1e3:5.1f}   {case['cb']:5.2f}   "
            f"{1e3 * case['contact_time']:5.3f}  {case['peak_force']:7.1f}   "
            f"{1e3 * case['peak_time']:5.3f}   {case['restitution']:9.4f}   "
            f"{case['rebound_speed']:8.2f}  {error:.0e}"
        )
    growth = [100.0 * q.value for q in (ball.stiffness_growth, ball.damping_growth)]
    print(
        f"kb {growth[0]:+.0f} %, cb {growth[1]:+.0f} % over {ball.speed_low.value:g}-"
        f"{ball.speed_high.value:g} m/s, held outside (published +52 %, +97 %); kb and cb at"
        f" {ball.speed_low.value:g} m/s are {ball.stiffness_low.status}, {ball.damping_low.status}"
    )
    if measured is not None:
        print(
            f"{options.signal} at {options.approach_speed:g} m/s:"
            f" contact {1e3 * found.contact_time:.3f} ms"
            f" ({found.samples} samples above {100 * options.threshold:g} % of the peak),"
            f" peak {found.peak_force:.1f} N at {1e3 * found.peak_time:.3f} ms,"
            f" impulse {found.impulse:.4f} N s, restitution {found.restitution:.4f}"
        )

    options.out.mkdir(parents=True, exist_ok=True)
    write_netcdf(data, options.out / "force_plate.nc")
    write_table(data.drop_dims("time"), options.out / "force_plate.csv")
    history = data[["force", "force_closed_form"]].transpose("time", "speed")
    write_csv(history, options.out / "force_history.csv")
    write_figure(force_plate_figure(data, measured), options.out / "force_plate.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies/force_plate.py"):
        main()
