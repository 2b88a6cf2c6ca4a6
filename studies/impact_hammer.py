"""The impact hammer on the bare, freely hung racket: frequency and damping from its ringing.

    python studies/impact_hammer.py --out impact_hammer --racket tour
    python studies/impact_hammer.py --out impact_hammer --pulse hammer.csv --direction in_plane

The source does not print the size of its pulses: without --pulse, a half sine of inferred size is
used. A pulse is a CSV with the columns `time [s]` and `force [N]`.
"""

import argparse
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr

from drake_racket import (
    JOINT_READINGS,
    InputError,
    RacketParameters,
    check_directory,
    load_racket,
    one_line_errors,
    read_signal,
    write_csv,
    write_figure,
    write_netcdf,
    write_table,
)
from drake_racket.plots import hammer_figure
from drake_racket.rigs import (
    DIRECTIONS,
    DURATION,
    HAMMER_SAMPLE_RATE,
    INFERRED_LENGTH,
    INFERRED_PEAK,
    acceleration_signal,
    analyse_ringing,
    bending_mode,
    half_sine,
    hammer_dataset,
    published_fundamentals,
    sampled_pulse,
)

LONGEST_STEP = 1e-3  # s; that a pulse has 20 samples is checked with the pulse


def ringing_dataset(strikes: Mapping[str, xr.Dataset], racket: RacketParameters) -> xr.Dataset:
    """Frequency and damping read from strikes, by direction, beside the model's and the published.

    Args:
        strikes: by direction, as `hammer_dataset` returns them.
        racket: whose strikes they are.

    Returns:
        A dataset over `direction`; what the source does not print is NaN.

    Raises:
        InputError: as `analyse_ringing`.

    """
    rows = []
    for direction, strike in strikes.items():
        place, end = strike.attrs["place_m"], strike.attrs["pulse_end_s"]
        ringing = analyse_ringing(acceleration_signal(strike), start=end)
        mode = bending_mode(racket, direction)
        in_plane, out_of_plane = published_fundamentals(racket.name.split("_")[0])
        rows.append(
            (
                ringing.frequency,
                ringing.spectrum_frequency,
                ringing.logarithmic_decrement,
                ringing.damping_ratio,
                ringing.fit_frequency,
                ringing.fit_damping_ratio,
                ringing.amplitude,
                mode.damped_frequency,
                mode.damping_ratio,
                mode.node,
                mode.node - place,
                in_plane if direction == "in_plane" else out_of_plane,
            )
        )
    names = (
        ("frequency", "Hz", "frequency, from the extrema"),
        ("spectrum_frequency", "Hz", "frequency, from the spectrum"),
        ("logarithmic_decrement", "1", "logarithmic decrement, from the extrema"),
        ("damping_ratio", "1", "damping ratio, from the decrement"),
        ("fit_frequency", "Hz", "frequency, from the fit"),
        ("fit_damping_ratio", "1", "damping ratio, from the fit"),
        ("amplitude", "m/s^2", "amplitude at the pulse's end, from the fit"),
        ("mode_frequency", "Hz", "damped frequency of the linear model"),
        ("mode_damping_ratio", "1", "damping ratio of the linear model"),
        ("node", "m", "node of the mode on the handle, from the butt"),
        ("distance_to_node", "m", "node less place of the hit"),
        ("published_frequency", "Hz", "published frequency (Glynn et al. 2011)"),
    )
    return xr.Dataset(
        {
            name: ("direction", column, {"units": units, "long_name": text})
            for (name, units, text), column in zip(names, np.transpose(rows), strict=True)
        },
        coords={"direction": ("direction", list(strikes), {"units": "", "long_name": "hit"})},
    )


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description="Impact hammer on the bare racket.")
    parser.add_argument("--out", type=Path, default=Path("impact_hammer"), help="output directory")
    parser.add_argument("--racket", default="tour", help="tour, recreational, or a YAML file")
    parser.add_argument("--joint-reading", choices=JOINT_READINGS, help="of the source's Table 2")
    parser.add_argument("--direction", nargs="+", choices=list(DIRECTIONS), default=[*DIRECTIONS])
    parser.add_argument("--place", type=float, help="of hammer and accelerometer, m from the butt")
    parser.add_argument("--peak", type=float, help=f"N (inferred: {INFERRED_PEAK:g})")
    parser.add_argument("--length", type=float, help=f"s (inferred: {INFERRED_LENGTH:g})")
    parser.add_argument("--pulse", type=Path, help="CSV with time [s] and force [N]")
    parser.add_argument("--duration", type=float, default=DURATION, help="s from the pulse on")
    parser.add_argument("--rate", type=float, default=HAMMER_SAMPLE_RATE, help="of the samples, Hz")
    return parser.parse_args()


def main() -> None:
    """Runs the study."""
    options = parse()
    check_directory(options.out, "--out")
    racket = load_racket(options.racket, joint_reading=options.joint_reading)
    if options.pulse is not None:
        if (options.peak, options.length) != (None, None):
            raise InputError("--pulse", options.pulse, "no --peak or --length beside it")
        signal = read_signal(options.pulse, "force", "N", longest_step=LONGEST_STEP)
        pulse, source = sampled_pulse(signal), "measured"
    else:
        given = (options.peak, options.length)
        pulse = half_sine(
            INFERRED_PEAK if options.peak is None else options.peak,
            INFERRED_LENGTH if options.length is None else options.length,
        )
        sources = ["inferred" if value is None else "given" for value in given]
        source = f"peak {sources[0]}, length {sources[1]}; the source prints neither"

    strikes = {
        direction: hammer_dataset(
            racket,
            direction,
            pulse,
            place=options.place,
            duration=options.duration,
            rate=options.rate,
        )
        for direction in dict.fromkeys(options.direction)
    }
    table = ringing_dataset(strikes, racket)
    place = next(iter(strikes.values())).attrs["place_m"]
    frame, reading = racket.title.split(",")[0], racket.throat_joint.reading.value
    print(f"{frame}, bare frame, free; joint labels: {reading}")
    print(f"pulse: {pulse.title} ({source}), impulse {1e3 * pulse.impulse:.1f} mN s")
    chosen = racket.landmarks.accelerometer.status if options.place is None else "given"
    print(f"hit and accelerometer {1e3 * place:.0f} mm from the butt ({chosen})")
    print(
        "direction      frequency  published  decrement  damping ratio   rings with  node is off by"
    )
    print("               Hz         Hz                    (cf/2 sqrt kfJ) m/s^2       mm")
    for direction in strikes:
        row = table.sel(direction=direction)
        print(
            f"{direction:13s}  {row['frequency']:8.2f}  {row['published_frequency']:9.0f}  "
            f"{row['logarithmic_decrement']:9.4f}  {row['damping_ratio']:.5f} "
            f"({row['mode_damping_ratio']:.5f})  {row['amplitude']:9.2f}   "
            f"{1e3 * row['distance_to_node']:8.1f}"
        )

    options.out.mkdir(parents=True, exist_ok=True)
    joined = xr.concat(
        strikes.values(),
        dim=xr.DataArray(list(strikes), dims="direction", name="direction"),
        combine_attrs="drop_conflicts",
    )
    joined["direction"].attrs = table["direction"].attrs
    write_netcdf(joined.merge(table), options.out / "impact_hammer.nc")
    write_table(table, options.out / "ringing.csv")
    for direction, strike in strikes.items():
        write_csv(strike, options.out / f"{direction}.csv")
    end = {direction: strike.attrs["pulse_end_s"] for direction, strike in strikes.items()}
    ringing = {
        d: analyse_ringing(acceleration_signal(strike), start=end[d])
        for d, strike in strikes.items()
    }
    published = {d: float(table["published_frequency"].sel(direction=d)) for d in strikes}
    figure = hammer_figure(strikes, ringing, published, f"{pulse.title} ({source})")
    write_figure(figure, options.out / "impact_hammer.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies/impact_hammer.py"):
        main()
