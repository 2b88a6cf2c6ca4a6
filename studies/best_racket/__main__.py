"""Where do mass, tension and stiffness go for the fastest ball, if the hand may not be hit harder?

    python -m studies.best_racket --out best_racket

The tour racket in a hand gets mass on the rim, at the throat and in the butt, another tension and
another frame stiffness. For several bounds on the peak force on the hand, gradients find the design
whose ball is fastest on average over the centre, 40 mm towards the tip and 30 mm to the side, while
the swingweight stays at most that of the published racket and the mass within 25 g of it. Since the
swingweight stays, so does the swing: the fastest ball is that of the largest apparent restitution.
Writes the trade-off (CSV) and its figure.
"""

import argparse
import csv
import dataclasses
import functools
from collections.abc import Mapping
from pathlib import Path

from drake_racket import (
    Case,
    Impacts,
    Optimum,
    Quantity,
    RacketParameters,
    Scenario,
    add_mass,
    check_directory,
    load_racket,
    one_line_errors,
    optimise_impacts,
    racket_properties,
    replace_file,
    resolve,
    write_figure,
)
from studies.best_racket.figures import trade_off_figure
from studies.swings import report

AIMS = {"centre": (0.0, 0.0), "40 mm to the tip": (0.04, 0.0), "30 mm to the side": (0.0, 0.03)}
PLACES = {
    "rim 12 h": ("12",),
    "rim 3 + 9 h": ("3", "9"),
    "throat 30 cm": ("30cm",),
    "butt": ("butt",),
}
BARE = 0.010
"""kg, that the head of the design is lighter than the published one before mass is added, so that
mass can move and not only be added."""
VARIABLES = {
    **{f"{place} [g]": (0.0, 20.0) for place in PLACES},
    "tension [%]": (60.0, 140.0),
    "frame stiffness [%]": (60.0, 200.0),
}
START = {
    "rim 12 h [g]": 2.0,
    "rim 3 + 9 h [g]": 4.0,
    "throat 30 cm [g]": 3.0,
    "butt [g]": 1.0,
    "tension [%]": 100.0,
    "frame stiffness [%]": 100.0,
}
SWING, BALL = 24.0, 12.0
"""m/s, of the racket where it is hit and of the ball that comes, for the table's ball speeds."""


def scaled(quantity: Quantity, share: float) -> Quantity:
    """The quantity, multiplied."""
    return dataclasses.replace(quantity, value=quantity.value * share)


def designed(racket: RacketParameters, values: Mapping[str, float]) -> RacketParameters:
    """The racket with the variables' masses, tension and stiffness."""
    head, joint, bed = racket.head, racket.throat_joint, racket.string_bed
    share = 1.0 - BARE / head.mass.value
    head = dataclasses.replace(
        head,
        mass=scaled(head.mass, share),
        moi_longitudinal=scaled(head.moi_longitudinal, share),
        moi_frontal=scaled(head.moi_frontal, share),
        moi_transverse=scaled(head.moi_transverse, share),
    )
    stiffness = values["frame stiffness [%]"] / 100.0
    joint = dataclasses.replace(
        joint,
        stiffness_in=scaled(joint.stiffness_in, stiffness),
        stiffness_out=scaled(joint.stiffness_out, stiffness),
    )
    bed = dataclasses.replace(
        bed, initial_tension=scaled(bed.initial_tension, values["tension [%]"] / 100.0)
    )
    racket = dataclasses.replace(racket, head=head, throat_joint=joint, string_bed=bed)
    for place, spots in PLACES.items():
        for spot in spots if values[f"{place} [g]"] else ():
            racket = add_mass(racket, 1e-3 * values[f"{place} [g]"] / len(spots), spot)
    return racket


def case_maker(base: Scenario, racket: RacketParameters):
    """Makes the case of one aim from the variables."""
    case = resolve(base)

    def make(values: Mapping[str, float]) -> Case:
        return dataclasses.replace(case, racket=designed(racket, values))

    return make


def row(name: str, found: Optimum) -> dict[str, float | str]:
    """One line of the table."""
    e = found.values["restitution"]
    return {
        "bound": name,
        "ball speed [m/s]": e * (SWING + BALL) + SWING,
        "restitution [1]": e,
        "peak force on hand [N]": found.values["peak_hand_force"],
        "swingweight [kg*m^2]": found.values["swingweight"],
        "mass [kg]": found.values["mass"],
        **found.variables,
        "held by": ", ".join((*found.active, *found.at_bound)),
        "out of reach": ", ".join(found.broken),
        "evaluations": found.evaluations,
    }


def as_it_starts(found: Optimum) -> Optimum:
    """The design that the search began with, as a line of the table."""
    return dataclasses.replace(
        found, values=found.start, variables=START, active=(), at_bound=(), broken=(), evaluations=1
    )


def main() -> None:
    """Reads the options, optimises, prints and writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("best_racket"))
    parser.add_argument("--racket", default="tour", help="a name, or a racket's file")
    parser.add_argument("--speed", type=float, default=25.0, help="of ball to racket (m/s)")
    parser.add_argument("--quick", action="store_true", help="the centre, one bound")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    racket = load_racket(options.racket)
    published = racket_properties(racket)
    base = Scenario(
        racket=options.racket, support="grip", speed=options.speed, after=0.015, engine="compiled"
    )
    aims = {"centre": (0.0, 0.0)} if options.quick else AIMS
    impacts = Impacts(
        [
            case_maker(dataclasses.replace(base, point="auto", offset_x=x, offset_y=y), racket)
            for x, y in aims.values()
        ],
        VARIABLES,
        ["restitution", "peak_hand_force", "swingweight", "mass"],
        start=START,
    )
    limits = {"swingweight": published.swingweight, "mass": published.mass + 0.025}
    search = functools.partial(
        optimise_impacts,
        impacts,
        iterations=4 if options.quick else 80,
        tolerance=1e-6,
        progress=report,
    )
    fastest = search(maximise="restitution", at_most=limits)
    rows = [row("as it starts", as_it_starts(fastest)), row("none", fastest)]
    if not options.quick:
        softest = search(
            minimise="peak_hand_force", at_most=limits, start=impacts.place(fastest.variables)
        )
        high, low = (found.values["peak_hand_force"] for found in (fastest, softest))
        place = impacts.place(fastest.variables)
        for share in (0.75, 0.5, 0.25):
            bound = low + share * (high - low)
            found = search(
                maximise="restitution",
                at_most={**limits, "peak_hand_force": bound},
                start=place,
            )
            place = impacts.place(found.variables)
            rows.append(row(f"{bound:.0f} N", found))
        rows.append(row("softest", softest))
    for line in rows:
        shown = (f"{v:.4g}" if isinstance(v, float) else str(v) for v in line.values())
        print("; ".join(f"{k} {v}" for k, v in zip(line, shown, strict=True)))
    options.out.mkdir(parents=True, exist_ok=True)

    def write(path: Path) -> None:
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)

    replace_file(options.out / "best_racket.csv", write)
    write_figure(trade_off_figure(rows, list(VARIABLES)), options.out / "best_racket.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies.best_racket"):
        main()
