"""Which racket returns more for my swing? Rackets by their shop rows, swings from slow to fast.

    python -m studies.which_racket_for_my_swing --out my_swing

Every racket of a table (CSV, as `drake-racket new --table` takes it; the study brings one) meets a
ball in swings of several rates about an axis behind the butt. Two players swing: one turns any
racket at the same rate, the other gives the same effort, and a racket of more swingweight comes
slower (`studies.swings`). Writes a table (CSV) and a figure.
"""

import argparse
import csv
from pathlib import Path
from typing import Any

from drake_racket import (
    check_directory,
    one_line_errors,
    rackets_from_table,
    replace_file,
    write_figure,
)
from drake_racket.compare import Swing, assess
from studies.swings import at_aim, eased, report
from studies.which_racket_for_my_swing.figures import swings_figure

TABLE = Path(__file__).parent / "rackets.csv"
REFERENCE = 0.0320  # kg m^2, the swingweight whose swing is the given one


def main() -> None:
    """Reads the options, runs the impacts, prints and writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("my_swing"))
    parser.add_argument("--table", type=Path, default=TABLE, help="of rackets (CSV)")
    parser.add_argument("--rates", type=float, nargs="+", default=[15.0, 22.0, 30.0])
    parser.add_argument("--pivot", type=float, default=0.2, help="from the axis to the butt (m)")
    parser.add_argument("--ball-speed", type=float, default=10.0, help="towards the racket (m/s)")
    parser.add_argument("--quick", action="store_true", help="two rackets, one rate")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    rackets = rackets_from_table(options.table)[: 2 if options.quick else None]
    rows: list[dict[str, Any]] = []
    for rate in options.rates[: 1 if options.quick else None]:
        given = Swing(rate, options.pivot, options.ball_speed)
        for racket in rackets:
            swingweight = racket.specs["swingweight"].value
            for player, swing in (
                ("same rate", given),
                ("same effort", eased(given, swingweight, REFERENCE)),
            ):
                found = assess(racket, swing=swing, hand=False, progress=report)
                rows.append(
                    {
                        "racket": racket.title,
                        "player": player,
                        "rate [rad/s]": rate,
                        "own rate [rad/s]": swing.rate,
                        "swingweight [kg*m^2]": swingweight,
                        "centre [m/s]": at_aim(found, found.ball_speed, 0.0),
                        "60 mm to tip [m/s]": at_aim(found, found.ball_speed, 0.06),
                        "best aim [m/s]": found.values["swing_speed_best"],
                        "restitution side [1]": found.values["restitution_4"],
                    }
                )
                line = rows[-1]
                print(
                    f"{player}, {rate:g} rad/s: {racket.title}: centre {line['centre [m/s]']:.2f},"
                    f" towards the tip {line['60 mm to tip [m/s]']:.2f} m/s"
                )
    options.out.mkdir(parents=True, exist_ok=True)

    def write(path: Path) -> None:
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)

    replace_file(options.out / "my_swing.csv", write)
    write_figure(swings_figure(rows), options.out / "my_swing.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies.which_racket_for_my_swing"):
        main()
