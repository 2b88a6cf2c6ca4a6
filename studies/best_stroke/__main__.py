"""How does the shipped arm hit the fastest ball, with joints that turn no faster than now?

    python -m studies.best_stroke --out best_stroke

The backhand of the package is changed in the racket's speed, the direction of its path and its
turning; the posture stays. Gradients find the stroke whose ball leaves fastest, upwards at 4 to 12
degrees, while no joint turns faster than the fastest one of the shipped stroke does: first for a
ball that meets the centre, then on average over the centre and four places around it. Writes the
strokes and what each does off centre (CSV), and a figure.
"""

import argparse
import csv
import dataclasses
import functools
import math
from pathlib import Path

import numpy as np

from drake_racket import (
    Case,
    CaseNumber,
    ImpactDiagram,
    ImpactResult,
    Impacts,
    Output,
    Scenario,
    check_directory,
    load_scenario,
    make_impact_diagram,
    one_line_errors,
    optimise_impacts,
    replace_file,
    resolve,
    simulate,
    write_figure,
)
from studies.best_stroke.figures import strokes_figure
from studies.swings import report

OFFSETS = {
    "centre": (0.0, 0.0),
    "tip": (0.03, 0.0),
    "throat": (-0.03, 0.0),
    "one side": (0.0, 0.025),
    "other side": (0.0, -0.025),
}
VARIABLES = {
    "limb.stroke.speed": (12.0, 22.0),
    "limb.stroke.velocity_elevation_deg": (0.0, 45.0),
    "limb.stroke.velocity_azimuth_deg": (-25.0, 25.0),
    "limb.stroke.angular_velocity.z": (-30.0, 0.0),
}
ELEVATION = (4.0, 12.0)
"""Degrees, of a ball that clears the net and falls within the court."""


def velocity_in_world(result: ImpactResult) -> np.ndarray:
    """The ball's rebound velocity in the world (m/s): R has the axes of the stroke's face."""
    R_WR = result.scenario.limb.stroke.pose_target().rotation()
    assert R_WR is not None
    return np.asarray(R_WR @ result.rebound_velocity)


def elevation(result: ImpactResult) -> float:
    """Angle (degrees) at which the ball rises."""
    v = velocity_in_world(result)
    return math.degrees(math.atan2(v[2], math.hypot(v[0], v[1])))


RISE = Output("rise", "degrees", "angle at which the ball leaves above the horizontal", elevation)


class JointRates:
    """Squared rates (rad^2/s^2) of the joints at the start: smooth, whatever their signs."""

    def __init__(self, system: ImpactDiagram) -> None:
        self.system = system
        self._last: tuple[Case, np.ndarray] | None = None

    def read(self, case: Case, *, joint: int) -> float:
        """That of one joint; those of a case are computed once."""
        if self._last is None or self._last[0] is not case:
            context = self.system.plant.GetMyContextFromRoot(self.system.create_context(case))
            limb = self.system.limb
            assert limb is not None
            rates = self.system.plant.GetVelocities(context)[limb.limb.velocity_indices()]
            self._last = case, rates**2
        return float(self._last[1][joint])


def setting(base: Scenario, offsets: list[tuple[float, float]], fastest: float | None):
    """The impacts to optimise over, and the squared rate that no joint may pass."""
    system = make_impact_diagram(base)
    assert system.limb is not None
    names = [joint.name() for joint in system.limb.limb.joints]
    joints = JointRates(system)
    rates = [
        CaseNumber(f"rate {name}", functools.partial(joints.read, joint=i))
        for i, name in enumerate(names)
    ]
    case = resolve(base)
    largest = max(number.read(case) for number in rates) if fastest is None else fastest**2
    scenarios = [
        dataclasses.replace(base, point="auto", offset_x=x, offset_y=y) for x, y in offsets
    ]
    impacts = Impacts(scenarios, VARIABLES, ["rebound_speed", RISE, *rates])
    return impacts, largest, [number.name for number in rates]


def row(name: str, base: Scenario, changes: dict[str, float]) -> list[dict[str, float | str]]:
    """What a stroke does at each place, a line each."""
    lines: list[dict[str, float | str]] = []
    for place, (x, y) in OFFSETS.items():
        scenario = dataclasses.replace(stroked(base, changes), point="auto", offset_x=x, offset_y=y)
        result = simulate(scenario, history=False)
        lines.append(
            {
                "stroke": name,
                "place": place,
                "ball speed [m/s]": float(np.linalg.norm(result.rebound_velocity)),
                "rise [degrees]": elevation(result),
                **changes,
            }
        )
    return lines


def stroked(base: Scenario, changes: dict[str, float]) -> Scenario:
    """The scenario with the stroke's numbers changed."""
    stroke = base.limb.stroke
    turning = (*stroke.angular_velocity[:2], changes["limb.stroke.angular_velocity.z"])
    stroke = dataclasses.replace(
        stroke,
        speed=changes["limb.stroke.speed"],
        velocity_elevation_deg=changes["limb.stroke.velocity_elevation_deg"],
        velocity_azimuth_deg=changes["limb.stroke.velocity_azimuth_deg"],
        angular_velocity=turning,
    )
    return dataclasses.replace(base, limb=dataclasses.replace(base.limb, stroke=stroke))


def main() -> None:
    """Reads the options, optimises, prints and writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("best_stroke"))
    parser.add_argument("--fastest", type=float, help="joint rate (rad/s); that of the backhand")
    parser.add_argument("--quick", action="store_true", help="the centre, few iterations")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    base = dataclasses.replace(load_scenario("backhand"), after=0.012, engine="compiled")
    searches = {"for the centre": [OFFSETS["centre"]]}
    if not options.quick:
        searches["for all five places"] = list(OFFSETS.values())
    stroke = base.limb.stroke
    shipped = {
        "limb.stroke.speed": stroke.speed,
        "limb.stroke.velocity_elevation_deg": stroke.velocity_elevation_deg,
        "limb.stroke.velocity_azimuth_deg": stroke.velocity_azimuth_deg,
        "limb.stroke.angular_velocity.z": float(stroke.angular_velocity[2] or 0.0),
    }
    rows = row("as shipped", base, shipped)
    for name, offsets in searches.items():
        impacts, largest, rates = setting(base, offsets, options.fastest)
        found = optimise_impacts(
            impacts,
            maximise="rebound_speed",
            at_most={"rise": ELEVATION[1], **dict.fromkeys(rates, largest)},
            at_least={"rise": ELEVATION[0]},
            iterations=2 if options.quick else 80,
            tolerance=1e-6,
            progress=report,
        )
        rows += row(name, base, found.variables)
        shown = ", ".join(f"{k.split('.', 2)[2]} {v:.4g}" for k, v in found.variables.items())
        print(f"{name}: {shown}")
        before, after = (v["rebound_speed"] for v in (found.start, found.values))
        print(
            f"  ball {before:.2f} -> {after:.2f} m/s, rise {found.values['rise']:.1f} degrees;"
            f" held by {', '.join((*found.active, *found.at_bound)) or 'nothing'};"
            f" {found.evaluations} evaluations; {found.message}"
        )
        if found.broken:
            print(f"  out of reach: {', '.join(found.broken)}")
    for line in rows:
        print(
            f"{line['stroke']}; {line['place']}; ball {line['ball speed [m/s]']:.2f} m/s;"
            f" rise {line['rise [degrees]']:.1f} degrees"
        )
    options.out.mkdir(parents=True, exist_ok=True)

    def write(path: Path) -> None:
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)

    replace_file(options.out / "best_stroke.csv", write)
    write_figure(strokes_figure(rows), options.out / "best_stroke.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies.best_stroke"):
        main()
