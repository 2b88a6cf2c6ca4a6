"""Where does the reaction to the contact force act: at the ball, or at the string mass?

    python studies/reaction_point.py --out reaction_point

The source speaks of forces between two particles. Once the ball has slid over the strings, two
opposite forces at two places are a couple: angular momentum and energy from nowhere. This study
hits the free racket at all nine points, straight and obliquely, with both readings, and prints
what the choice changes and what the couple adds.
"""

import argparse
import csv
from pathlib import Path

import numpy as np

import drake_racket as dr

parser = argparse.ArgumentParser(description="Both readings of the reaction, at nine points.")
parser.add_argument("--out", type=Path, default=Path("reaction_point"), help="output directory")
parser.add_argument("--points", type=int, nargs="+", default=list(range(1, 10)))
arguments = parser.parse_args()

system = dr.make_impact_diagram(dr.Scenario())
rows = []
for speed, incidence in ((25.0, 0.0), (31.0, 17.0)):
    for point in arguments.points:
        case = {"speed": speed, "incidence_deg": incidence, "point": point, "after": 0.008}
        ball, string_mass = (
            dr.simulate(dr.Scenario(reaction_point=r, **case), system, history=False)
            for r in ("ball", "string_mass")
        )
        assert string_mass.balance is not None
        energy = 0.5 * dr.load_ball().mass.value * speed**2
        rows.append(
            {
                "speed [m/s]": speed,
                "incidence [deg]": incidence,
                "point": point,
                "restitution at ball": ball.apparent_restitution,
                "restitution at string mass": string_mass.apparent_restitution,
                "angle at ball [deg]": np.degrees(ball.rebound_angle),
                "angle at string mass [deg]": np.degrees(string_mass.rebound_angle),
                "couple work [J]": string_mass.balance.couple,
                "couple work / initial energy": string_mass.balance.couple / energy,
                "angular momentum error at ball": ball.angular_momentum_error,
                "angular momentum error at string mass": string_mass.angular_momentum_error,
            }
        )
        row = rows[-1]
        print(
            f"{speed:g} m/s {incidence:4.0f} deg  point {point}:  restitution"
            f" {row['restitution at ball']:.3f} at the ball,"
            f" {row['restitution at string mass']:.3f} at the string mass;"
            f"  the couple adds {100 * row['couple work / initial energy']:+.2f} % energy,"
            f" {100 * row['angular momentum error at string mass']:.2f} % angular momentum"
        )
arguments.out.mkdir(parents=True, exist_ok=True)
path = arguments.out / "reaction_point.csv"
with path.open("w", newline="") as file:
    writer = csv.DictWriter(file, fieldnames=list(rows[0]))
    writer.writeheader()
    writer.writerows(rows)
print(f"wrote {path}")
