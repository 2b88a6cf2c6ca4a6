"""Do two checkouts of the package compute the same numbers? One table, made by two commands.

    python benchmarks/same_numbers.py collect BEFORE.json --checkout ../old
    python benchmarks/same_numbers.py collect AFTER.json
    python benchmarks/same_numbers.py compare BEFORE.json AFTER.json --out docs/same_numbers.md

`collect` runs a checkout with the Python that runs this script: the 108 default impacts (four beds,
nine points; head clamped at 18 and 33 m/s, free at 25 m/s), one impact in a hand and one in the
shipped limb, the recovery study and
the validation report. `compare` prints the largest difference of
each group, relative to the largest number of its vector (of its balance, for an energy), and every
number that differs by more than 1e-12.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent.parent
ALLOWED = 1e-12
"""Relative difference up to which two numbers count as the same."""

IMPACTS = """
import json, sys
import drake_racket as dr
cases = {}
for racket in ("tour", "recreational"):
    for tension in ("low", "high"):
        for support, speed in (("clamped_head", 18.0), ("clamped_head", 33.0), ("free", 25.0)):
            for point in range(1, 10):
                key = f"{racket} {tension} {support} {speed:g} m/s point {point}"
                cases[key] = dict(
                    racket=racket, tension=tension, support=support, speed=speed, point=str(point)
                )
cases["in a hand, point 4"] = dict(support="grip", point="4")
cases["in the limb, point 6"] = dict(support="limb", point="6", after=0.02)
found = {}
for key, changes in cases.items():
    result = dr.simulate(dr.Scenario(**changes), history=changes["support"] in ("grip", "limb"))
    tree = result.to_json()
    tree.pop("scenario")
    found[key] = tree
json.dump(found, open(sys.argv[1], "w"))
"""

RECOVERED = """
import json, pathlib, sys
import xarray
found = {}
for path in sorted(pathlib.Path(sys.argv[1]).glob("*.nc")):
    data = xarray.load_dataset(path, engine="h5netcdf")
    found[path.stem] = {
        str(name): values.to_numpy().tolist()
        for name, values in data.data_vars.items()
        if "second" not in str(name) and values.dtype.kind in "fi"
    }
json.dump(found, open(sys.argv[2], "w"))
"""


def run(checkout: Path, *arguments: str) -> None:
    """Runs this Python on the package of `checkout`."""
    environment = os.environ | {"PYTHONPATH": str(checkout)}
    subprocess.run([sys.executable, *arguments], cwd=checkout, env=environment, check=True)


def collect(checkout: Path, repeats: int) -> dict[str, Any]:
    """All numbers of a checkout, by group."""
    study = checkout / "studies" / "identification_recovery.py"
    recovery = [str(study)] if study.is_file() else ["-m", "studies.identification_recovery"]
    with tempfile.TemporaryDirectory() as directory:
        work = Path(directory)
        run(checkout, "-c", IMPACTS, str(work / "impacts.json"))
        options = ["--repeats", str(repeats), "--frame-repeats", str(min(repeats, 10))]
        run(checkout, *recovery, "--out", str(work / "recovery"), *options)
        run(checkout, "-c", RECOVERED, str(work / "recovery"), str(work / "recovery.json"))
        run(checkout, "-m", "drake_racket.cli", "validate", "--out", str(work / "validation"))
        return {
            "impacts": json.loads((work / "impacts.json").read_text()),
            "recovery": json.loads((work / "recovery.json").read_text()),
            "validation": json.loads((work / "validation" / "rows.json").read_text()),
        }


def numbers(tree: Any, key: str = "") -> Iterator[tuple[str, float]]:
    """Every number below `tree` with its dotted key."""
    if isinstance(tree, dict):
        for name, value in tree.items():
            yield from numbers(value, f"{key}.{name}" if key else str(name))
    elif isinstance(tree, list):
        for i, value in enumerate(tree):
            yield from numbers(value, f"{key}[{i}]")
    elif isinstance(tree, int | float) and not isinstance(tree, bool):
        yield key, float(tree)


def family(key: str) -> str:
    """What a number is measured against: its vector, and the energies of one balance together."""
    key = key.partition("[")[0]
    energy = ".balance." in key and not key.endswith(("momentum", "on_ball"))
    return key.rpartition(".")[0] if energy else key


def scales(found: dict[str, float]) -> dict[str, float]:
    """The largest magnitude in each family."""
    largest: dict[str, float] = {}
    for key, number in found.items():
        if math.isfinite(number):
            largest[family(key)] = max(largest.get(family(key), 0.0), abs(number))
    return largest


def difference(before: float, after: float, scale: float) -> float:
    """Relative to `scale`; 0 for two that are equal or both no number."""
    if before == after or (math.isnan(before) and math.isnan(after)):
        return 0.0
    off = abs(before - after) / scale if scale else math.inf
    return off if math.isfinite(off) else math.inf


def compare(before: dict[str, Any], after: dict[str, Any]) -> str:
    """The table, and below it what differs."""
    lines = [
        "| group | numbers | equal to the last bit | largest relative difference |",
        "|---|---:|---:|---:|",
    ]
    listed: list[str] = []
    for group in before:
        old, new = dict(numbers(before[group])), dict(numbers(after.get(group, {})))
        size = scales(old)
        off = {
            k: difference(v, new[k], size.get(family(k), 0.0)) for k, v in old.items() if k in new
        }
        equal = sum(x == 0.0 for x in off.values())
        lines.append(f"| {group} | {len(off)} | {equal} | {max(off.values(), default=0.0):.1e} |")
        listed += [
            f"- `{group}: {k}`: {old[k]!r}, {new[k]!r} ({x:.1e})"
            for k, x in off.items()
            if x > ALLOWED
        ]
        for title, keys in (("gone", set(old) - set(new)), ("new", set(new) - set(old))):
            listed += [f"- `{group}: {k}`: {title}" for k in sorted(keys)]
    return "\n".join([*lines, "", *listed]) + "\n"


def main() -> None:
    """Reads the options and does what they say."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("collect", help="run a checkout and keep its numbers")
    one.add_argument("file", type=Path)
    one.add_argument("--checkout", type=Path, default=HERE)
    one.add_argument("--repeats", type=int, default=10, help="of each part of the recovery study")
    two = commands.add_parser("compare", help="print the table")
    two.add_argument("before", type=Path)
    two.add_argument("after", type=Path)
    two.add_argument("--out", type=Path, help="a Markdown file for the table")
    options = parser.parse_args()
    if options.command == "collect":
        found = collect(options.checkout.resolve(), options.repeats)
        options.file.write_text(json.dumps(found))
        return
    before, after = (json.loads(p.read_text()) for p in (options.before, options.after))
    text = compare(before, after)
    print(text)
    if options.out is not None:
        options.out.write_text(text)


if __name__ == "__main__":
    main()
