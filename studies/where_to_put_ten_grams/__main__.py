"""Where do I put ten grams? One place after the other, and what each does.

    python -m studies.where_to_put_ten_grams --out ten_grams

A racket (the published tour racket, or your file) gets the same mass at the butt, along the handle,
at the tip, and in pairs on the rim. For each place: mass, balance, swingweight, twistweight,
restitution at the centre, towards the tip and at the side, ball speed of a swing at the same rate
and at the same effort (`studies.swings`), and what shakes the handle and loads the hand. Writes a
table (CSV) and a figure.
"""

import argparse
import csv
import dataclasses
from pathlib import Path

from drake_racket import (
    RacketParameters,
    add_mass,
    check_directory,
    load_racket,
    one_line_errors,
    replace_file,
    write_figure,
)
from drake_racket.compare import Assessment, Swing, assess
from studies.swings import at_aim, eased, report, speeds
from studies.where_to_put_ten_grams.figures import places_figure

PLACES = {
    "nowhere": (),
    "butt": ("butt",),
    "10 cm": ("10cm",),
    "throat, 30 cm": ("30cm",),
    "4 and 8 o'clock": ("4", "8"),
    "3 and 9 o'clock": ("3", "9"),
    "2 and 10 o'clock": ("2", "10"),
    "12 o'clock": ("12",),
}


def with_mass(racket: RacketParameters, mass: float, places: tuple[str, ...]) -> RacketParameters:
    """The racket with `mass` (kg) shared by the places."""
    for place in places:
        racket = add_mass(racket, mass / len(places), place)
    return racket


def row(name: str, found: Assessment, swing: Swing, reference: float) -> dict[str, float | str]:
    """One line of the table, SI."""
    v = found.values
    effort = speeds(found, eased(swing, v["swingweight"], reference))
    return {
        "place": name,
        "mass [kg]": v["mass"],
        "balance [m]": v["balance"],
        "swingweight [kg*m^2]": v["swingweight"],
        "twistweight [kg*m^2]": v["twistweight"],
        "restitution centre [1]": v["restitution_5"],
        "restitution tip [1]": v["restitution_2"],
        "restitution side [1]": v["restitution_4"],
        "same rate, centre [m/s]": at_aim(found, found.ball_speed, 0.0),
        "same effort, centre [m/s]": at_aim(found, effort, 0.0),
        "same rate, 60 mm to tip [m/s]": at_aim(found, found.ball_speed, 0.06),
        "same effort, 60 mm to tip [m/s]": at_aim(found, effort, 0.06),
        "ringing of handle [m/s^2]": v["handle_ringing"],
        "peak force on hand [N]": v["peak_hand_force"],
    }


def main() -> None:
    """Reads the options, runs the impacts, prints and writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("ten_grams"))
    parser.add_argument("--racket", default="tour", help="a name, or a racket's file")
    parser.add_argument("--mass", type=float, default=0.010, help="kg")
    parser.add_argument("--rate", type=float, default=27.0, help="of the swing (rad/s)")
    parser.add_argument("--quick", action="store_true", help="two places")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    swing = dataclasses.replace(Swing(), rate=options.rate)
    racket = load_racket(options.racket)
    chosen = {k: PLACES[k] for k in ("nowhere", "12 o'clock")} if options.quick else PLACES
    rackets = {name: with_mass(racket, options.mass, places) for name, places in chosen.items()}
    found = {name: assess(r, swing=swing, progress=report) for name, r in rackets.items()}
    reference = found["nowhere"].values["swingweight"]
    rows = [row(name, one, swing, reference) for name, one in found.items()]
    for line in rows:
        first, *rest = line.items()
        print(first[1], *(f"{key} {value:.4g}" for key, value in rest), sep="; ")
    options.out.mkdir(parents=True, exist_ok=True)

    def write(path: Path) -> None:
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)

    replace_file(options.out / "ten_grams.csv", write)
    write_figure(places_figure(rows, options.mass), options.out / "ten_grams.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies.where_to_put_ten_grams"):
        main()
