"""Fits a hand that has mass to frequencies and dampings of rackets in players' hands.

    python studies/hand_presets.py --out hand_presets

Savage (2006) struck two rackets with balls, free and held lightly, medium and tightly: the first
bending frequency fell by 7 to 12 %, its damping ratio rose six-fold. A hand fixed in space can only
raise frequencies; one with mass lowers them. Here the hand has the mass and moments of de Leva's
(1996), at one place on the handle, and the palm's springs are sought: force stiffness k, force
damping c and torque damping d, three numbers a grip for its two frequency ratios and two damping
ratios. The torque stiffness is k spread evenly over a hand 0.09 m broad.

Savage's rackets are not described: both are taken to have the tour racket's masses, six segments,
and their own free frequency and damping.

Leaves the three grip files and a table of residuals.
"""

import argparse
import dataclasses
from pathlib import Path

import numpy as np
from scipy.optimize import brentq, least_squares

from drake_racket import (
    HANDS,
    GripStiffness,
    RacketParameters,
    apply_overrides,
    check_directory,
    load_grip,
    load_racket,
    one_line_errors,
    write_grip,
    write_text,
)
from drake_racket.rigs import modal_system, solve_modes

SOURCE = "Savage (2006), PhD thesis, RMIT, Appendix 4"
FREE = {"A": (183.75, 0.010), "B": (162.5, 0.0115)}
"""Racket -> Hz and damping ratio (half of the loss factor), free."""
HELD = {
    "hand_light": {"A": (170.25, 0.062), "B": (149.0, 0.060)},
    "hand_medium": {"A": (165.0, 0.064), "B": (146.25, 0.065)},
    "hand_tight": {"A": (162.25, 0.075), "B": (142.5, 0.078)},
}
BREADTH = 0.09  # m, of a hand on a handle
ROLL_STIFFNESS, ROLL_DAMPING = 0.4, 0.37
"""About the handle's axis over across it, as in grip_normal.yaml."""
SEGMENTS = 6
RANGES = {"k": (1e4, 4e5), "c": (20.0, 500.0), "d": (0.02, 3.0)}
"""N/m, N s/m, N m s/rad: where the palm's numbers are sought."""


def racket_like(name: str) -> RacketParameters:
    """Gives a racket whose strung, free frequency and damping are Savage's."""
    frequency, damping = FREE[name]
    tour = load_racket("tour")

    def with_frequency(bare: float) -> RacketParameters:
        stiffness, _ = tour.throat_joint.out_of_plane()
        loss = damping / (np.pi * frequency)  # s, damping over stiffness
        factor = (bare / 128.541148) ** 2
        return apply_overrides(
            tour,
            {
                "racket.frame.segments": SEGMENTS,
                "racket.throat_joint.out_of_plane_stiffness": stiffness * factor,
                "racket.throat_joint.out_of_plane_damping": stiffness * factor * loss,
            },
        )

    def left(bare: float) -> float:
        return bending(with_frequency(bare), None)[0] - frequency

    return with_frequency(brentq(left, 0.8 * frequency, 1.2 * frequency, xtol=1e-3))


def bending(racket: RacketParameters, grip: GripStiffness | None) -> tuple[float, float]:
    """Gives the damped frequency (Hz) and the damping ratio of the first bending out of plane."""
    support = "free" if grip is None else "grip"
    modes = solve_modes(modal_system(racket, support=support, grip=grip))
    shares = modes.strain_shares[:, modes.elements.index("out_of_plane")]
    low = modes.frequencies < 300.0
    at = int(np.argmax(np.where(low, shares, -1.0)))
    return float(modes.damped_frequencies[at]), float(modes.damping_ratios[at])


def with_palm(grip: GripStiffness, palm: np.ndarray) -> GripStiffness:
    """Gives a grip with the palm's k (N/m), c (N s/m) and d (N m s/rad)."""
    k, c, d = palm.tolist()
    turn = k * BREADTH**2 / 12.0
    values = {
        "force_stiffness": (k, k, k),
        "force_damping": (c, c, c),
        "torque_stiffness": (ROLL_STIFFNESS * turn, turn, turn),
        "torque_damping": (ROLL_DAMPING * d, d, d),
    }
    new = {
        key: dataclasses.replace(
            getattr(grip, key), value=tuple(float(f"{x:.4g}") for x in numbers)
        )
        for key, numbers in values.items()
    }
    return dataclasses.replace(grip, **new)


Rows = list[list[object]]


def fit(name: str, rackets: dict[str, RacketParameters]) -> tuple[GripStiffness, Rows]:
    """Fits one preset; gives it and the rows of its residuals."""
    grip, low = load_grip(name), np.log([a for a, _ in RANGES.values()])
    high = np.log([b for _, b in RANGES.values()])

    def rows(made: GripStiffness) -> Rows:
        table: Rows = []
        for racket, parameters in rackets.items():
            frequency, damping = bending(parameters, made)
            free, measured = FREE[racket], HELD[name][racket]
            ratio = frequency / free[0], measured[0] / free[0]
            table.append([name, racket, *ratio, damping, measured[1]])
        return table

    def residuals(x: np.ndarray) -> np.ndarray:
        table = rows(with_palm(grip, np.exp(x)))
        left = [[(r[2] - r[3]) / 0.01, (r[4] / r[5] - 1.0) / 0.1] for r in table]  # type: ignore[operator]
        return np.ravel(left)

    starts = [[3e4, 100.0, 0.1], [2e5, 200.0, 0.5], [1e5, 60.0, 1.5]]
    found = [
        least_squares(residuals, np.log(start), bounds=(low, high), max_nfev=40, diff_step=1e-3)
        for start in starts
    ]
    best = min(found, key=lambda result: float(result.cost))
    made = with_palm(grip, np.exp(best.x))
    return made, rows(made)


def main() -> None:
    """Reads the options, fits, prints and writes."""
    parser = argparse.ArgumentParser(description="Fit hands with mass to measured rackets.")
    parser.add_argument("--out", type=Path, default=Path("hand_presets"), help="directory")
    parser.add_argument("--grips", nargs="+", choices=HANDS, default=list(HANDS))
    options = parser.parse_args()
    check_directory(options.out, "--out")
    rackets = {name: racket_like(name) for name in FREE}
    options.out.mkdir(parents=True, exist_ok=True)
    header = ["grip", "racket", "ratio", "measured_ratio", "damping", "measured_damping"]
    table: Rows = []
    print("frequency over the free one's, and damping ratio: model (measured)")
    for name in options.grips:
        grip, rows = fit(name, rackets)
        table += rows
        write_grip(grip, options.out / f"grip_{name}.yaml")
        k, c = grip.force_stiffness.value[2], grip.force_damping.value[2]
        print(f"{name}: k {k:g} N/m, c {c:g} N s/m, d {grip.torque_damping.value[1]:g} N m s/rad")
        for row in rows:
            print("  racket {1}: {2:.3f} ({3:.3f}), {4:.4f} ({5:.4f})".format(*row))
    lines = [",".join(header), *(",".join(map(str, row)) for row in table)]
    write_text("\n".join(lines) + "\n", options.out / "residuals.csv")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies/hand_presets.py"):
        main()
