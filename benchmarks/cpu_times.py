"""What do import, help, one impact and its history cost, here and in another checkout?

    python benchmarks/cpu_times.py --against ../old --out docs/cpu_times.md

Each command is a process of its own; the two checkouts take turns, so that they meet the same
machine. CPU seconds (user and system), median of the repeats.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent.parent

WITHIN = """
import statistics, time
import drake_racket as dr
scenario = dr.Scenario({scenario})
system = dr.make_impact_diagram(scenario)
dr.simulate(scenario, system)
seconds = {{False: [], True: []}}
for history in (False, True, True, False, False, True):  # in turns, in both orders
    began = time.process_time()
    dr.simulate(scenario, system, history=history)
    seconds[history].append(time.process_time() - began)
print(*(statistics.median(seconds[history]) for history in (False, True)))
"""
COMMAND = "from drake_racket.cli import main; main()"
PROCESSES = {
    "import drake_racket, and what simulate needs": ["-c", "import drake_racket as d; d.simulate"],
    "drake-racket --help": ["-c", COMMAND, "--help"],
    "drake-racket impact --out DIR": ["-c", COMMAND, "impact", "--out", "DIR"],
}
LIMB = "support='limb', point='6', after=0.02"
CALLS = {
    "simulate, free, 50 ms": WITHIN.format(scenario=""),
    "simulate, limb, 20 ms": WITHIN.format(scenario=LIMB),
}


def run(checkout: Path, arguments: list[str]) -> tuple[float, str]:
    """CPU seconds of a process, and what it printed."""
    environment = os.environ | {"PYTHONPATH": str(checkout)}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as directory:
        out = [directory if a == "DIR" else a for a in arguments]
        done = subprocess.run(
            [sys.executable, *out],
            cwd=directory,
            env=environment,
            check=True,
            capture_output=True,
            text=True,
        )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return spent, done.stdout


def measure(checkouts: list[Path], repeats: int) -> dict[str, list[float]]:
    """Median CPU seconds by name, one for each checkout."""
    found: dict[str, list[list[float]]] = {}
    for turn in range(repeats + 1):  # the first warms caches
        for name, arguments in PROCESSES.items():
            for i, checkout in enumerate(checkouts):
                seconds, _ = run(checkout, arguments)
                found.setdefault(name, [[] for _ in checkouts])[i].append(seconds)
        for name, code in CALLS.items():
            for i, checkout in enumerate(checkouts):
                _, printed = run(checkout, ["-c", code])
                for history, seconds in zip((False, True), printed.split(), strict=True):
                    row = f"{name}, history={history}"
                    found.setdefault(row, [[] for _ in checkouts])[i].append(float(seconds))
        print(f"round {turn} of {repeats}", file=sys.stderr, flush=True)
    return {name: [statistics.median(x[1:]) for x in lists] for name, lists in found.items()}


def main() -> None:
    """Reads the options, measures, prints and writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--against", type=Path, help="another checkout")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--out", type=Path, help="a Markdown file for the table")
    options = parser.parse_args()
    checkouts = [HERE] if options.against is None else [options.against.resolve(), HERE]
    found = measure(checkouts, options.repeats)
    head = ["here"] if options.against is None else ["before", "here", "here / before"]
    lines = [f"| CPU seconds | {' | '.join(head)} |", "|---|" + "---:|" * len(head)]
    for name, seconds in found.items():
        cells = [f"{s:.2f}" for s in seconds]
        if len(seconds) == 2:
            cells.append(f"{seconds[1] / seconds[0]:.2f}")
        lines.append(f"| {name} | {' | '.join(cells)} |")
    text = "\n".join(lines) + "\n"
    print(text)
    if options.out is not None:
        options.out.write_text(text)


if __name__ == "__main__":
    main()
