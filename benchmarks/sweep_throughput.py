"""1,000 impacts of the free racket by one process, two, and a local Dask cluster; memory by case.

    python benchmarks/sweep_throughput.py                 # 1,000 cases, a quarter of an hour
    python benchmarks/sweep_throughput.py --after 0.01    # without the ringing, five minutes

Two halves of the cases run in each of the three ways, the second half in reverse order, so that
what else the machine does meets all of them. The times are of whole sweeps: checking the cases,
starting processes (the Dask workers are there before), and writing the results. Memory is that of
the process that simulates, read after every case of the first half, when it works alone.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from time import perf_counter

import numpy as np
import xarray
from distributed import Client, LocalCluster
from measure import table, versions
from numpy.typing import NDArray

from drake_racket import Scenario
from drake_racket.sweep import Progress, Sweep, make_sweep, run_sweep

HALVES = 2


def half(cases: int, number: int, after: float) -> Sweep:
    """A Latin hypercube over what users vary; `number` is its seed."""
    bounds = {
        "speed": (18.0, 33.0, "m/s"),
        "offset_x": (-0.06, 0.06, "m"),
        "offset_y": (-0.04, 0.04, "m"),
        "racket.head.mass": (0.150, 0.170, "kg"),
        "racket.throat_joint.out_of_plane_stiffness": (800.0, 1000.0, "N*m/rad"),
        "racket.string_bed.initial_tension": (600.0, 700.0, "N"),
    }
    keys = {name: {"from": a, "to": b, "unit": unit} for name, (a, b, unit) in bounds.items()}
    design = {"design": "latin_hypercube", "samples": cases, "seed": number, "keys": keys}
    base = Scenario(audit=False, point="auto", after=after)
    return make_sweep(base, {"sample": design})


def resident() -> float:
    """Memory of this process (MB), from /proc."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def main() -> None:
    formatter = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=formatter)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--after", type=float, default=0.05, help="s simulated from touch on")
    arguments = parser.parse_args()
    size = max(2, arguments.cases // HALVES)
    memory: list[float] = []

    def remember(progress: Progress) -> None:
        if progress.phase == "running" and len(memory) < size:
            memory.append(resident())

    with ExitStack() as stack:
        options = {"processes": True, "threads_per_worker": 1, "dashboard_address": None}
        cluster = stack.enter_context(LocalCluster(n_workers=2, **options))
        client = stack.enter_context(Client(cluster, set_as_default=False))
        ways: dict[str, Callable[[Sweep, Path], xarray.Dataset]] = {
            "1 process": lambda sweep, out: run_sweep(sweep, out, progress=remember),
            "2 processes": lambda sweep, out: run_sweep(sweep, out, workers=2),
            "Dask, 2 workers": lambda sweep, out: run_sweep(sweep, out, scheduler=client),
        }
        for run in ways.values():  # imports and compilation, once
            with tempfile.TemporaryDirectory() as out:
                run(half(8, 10_000, arguments.after), Path(out))
        memory.clear()
        seconds = dict.fromkeys(ways, 0.0)
        equal = True
        for number in range(HALVES):
            sweep, results = half(size, number, arguments.after), []
            for name in list(ways) if number == 0 else reversed(ways):
                with tempfile.TemporaryDirectory() as out:
                    start = perf_counter()
                    results.append(ways[name](sweep, Path(out)))
                    seconds[name] += perf_counter() - start
            equal &= all(result.identical(results[0]) for result in results)
    report(seconds, size * HALVES, np.array(memory), equal)


def report(seconds: dict[str, float], cases: int, memory: NDArray[np.float64], equal: bool) -> None:
    """Prints the tables."""
    print(versions("distributed"))
    alone = seconds["1 process"]
    rows = [
        [name, f"{taken:.1f} s", f"{cases / taken:.2f}", f"{alone / taken:.2f}x"]
        for name, taken in seconds.items()
    ]
    print(table(["way", f"{cases} cases", "cases/s", "speed-up"], rows))
    overhead = seconds["Dask, 2 workers"] / seconds["2 processes"] - 1.0
    print(f"Dask against 2 processes: {100 * overhead:+.1f} %")
    print(f"results bit-equal: {equal}")
    start = min(100, len(memory) // 2)
    growth = memory[start:].max() / memory[start] - 1.0
    print(
        f"memory: {memory[0]:.0f} MB before, {memory[start]:.0f} MB after {start} cases, then up to"
        f" {100 * growth:+.1f} % over {len(memory) - 1 - start} more"
    )


if __name__ == "__main__":
    main()
