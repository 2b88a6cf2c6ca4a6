"""Is the paper's contact the same to the last bit in two checkouts, on every engine?

    python benchmarks/same_paper.py collect BEFORE.json --checkout ../old
    python benchmarks/same_paper.py collect AFTER.json
    python benchmarks/same_paper.py compare BEFORE.json AFTER.json

Thirteen impacts of contact `paper` (both rackets, all points, 0 to 60 degrees, both readings of
friction, four supports) in the Drake and in the compiled engine, one on a discrete plant, exact
derivatives of one, and 36 of the clamped engine with theirs: all numbers, compared with ==.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent.parent

IMPACTS = """
import json, sys
import drake_racket as dr
from drake_racket.engines.clamped.batch import make_bed, make_impacts, run

def numbers(result):
    tree = result.to_json()
    tree.pop("scenario")
    return tree

found = {}
cases = [(s, a, r) for s, a, r in (
    ("free", 0, "velocity"), ("free", 17, "velocity"), ("free", 40, "displacement"),
    ("free", 60, "velocity"), ("grip", 0, "velocity"), ("grip", 17, "displacement"),
    ("grip", 40, "velocity"), ("grip", 60, "velocity"), ("clamped_head", 0, "velocity"),
    ("clamped_head", 17, "velocity"), ("clamped_handle", 40, "velocity"),
    ("clamped_head", 60, "displacement"), ("free", 30, "velocity"),
)]
for engine in ("drake", "compiled"):
    for n, (support, angle, reading) in enumerate(cases):
        scenario = dr.Scenario(
            engine=engine, support=support, incidence_deg=angle, friction_reading=reading,
            point=str(1 + n % 9), racket=("tour", "recreational")[n % 2], after=0.03,
        )
        key = f"{engine}, {support}, {angle} degrees, {reading}"
        found[key] = numbers(dr.simulate(scenario, history=True))
found["discrete"] = numbers(dr.simulate(dr.Scenario(time_step=1e-5, incidence_deg=17)))
keys = ["ball.stiffness_low", "speed", "racket.friction.coefficients.mu1"]
one = dr.simulate(dr.Scenario(engine="compiled"), derivatives=keys, history=False)
names = "rebound_speed", "contact_time"
found["derivatives"] = [[one.derivatives.of(n, k) for n in names] for k in keys]
racket, ball = dr.load_racket(), dr.load_ball()
for reading in ("velocity", "displacement"):
    velocities = [[0.0, 3.0 * i, -18.0 - i] for i in range(18)]
    impacts = make_impacts(
        racket, ball, list(range(1, 10)) * 2, velocities, friction_reading=reading, free=3
    )
    outcome = run([make_bed(racket, free=["T0", "k1", "p2"])], impacts)
    found[f"clamped, {reading}"] = [outcome.values.tolist(), outcome.jacobian.tolist()]
json.dump(found, open(sys.argv[1], "w"))
"""


def collect(checkout: Path) -> dict[str, Any]:
    """All numbers of a checkout, by case."""
    environment = {**os.environ, "PYTHONPATH": str(checkout)}
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "found.json"
        command = [sys.executable, "-c", IMPACTS, str(path)]
        subprocess.run(command, check=True, cwd=checkout, env=environment)
        found: dict[str, Any] = json.loads(path.read_text())
        return found


def main() -> None:
    """Collects or compares."""
    parser = argparse.ArgumentParser(description="The paper's contact, to the last bit.")
    commands = parser.add_subparsers(dest="command", required=True)
    collecting = commands.add_parser("collect")
    collecting.add_argument("out", type=Path)
    collecting.add_argument("--checkout", type=Path, default=HERE)
    comparing = commands.add_parser("compare")
    comparing.add_argument("before", type=Path)
    comparing.add_argument("after", type=Path)
    options = parser.parse_args()
    if options.command == "collect":
        options.out.write_text(json.dumps(collect(options.checkout.resolve())))
        return
    before, after = (json.loads(p.read_text()) for p in (options.before, options.after))
    # as text: a number that is not finite equals itself there
    other = [k for k in before if json.dumps(before[k]) != json.dumps(after.get(k))]
    print(f"{len(before)} cases, {len(other)} of them differ")
    for key in other:
        print(f"  {key}")
    raise SystemExit(1 if other else 0)


if __name__ == "__main__":
    main()
