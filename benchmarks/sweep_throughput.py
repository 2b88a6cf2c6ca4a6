"""1,000 impacts of the free racket by one process, two, and local Dask clusters; memory by case.

    python benchmarks/sweep_throughput.py                 # 1,000 cases, an hour
    python benchmarks/sweep_throughput.py --after 0.01    # without the ringing, a third of that
    python benchmarks/sweep_throughput.py --no-dask       # one and two processes, nothing beside
    python benchmarks/sweep_throughput.py --memory        # one sweep in one process, memory only

The cases are 20 sweeps, each run in all four ways in turns, since the speed of shared cores
wanders by more than what is to be compared. Two measures: the time of whole sweeps (checking the
cases, starting processes, writing the results; the Dask workers are up before), summed; and the
rate of finishing cases from the third one on, which is without all that: its median over the
sweeps, and ratios of medians with a bootstrapped 95 % interval. Memory is that of a process
that simulates 1,000 cases as one sweep, read after each; here, where Dask's schedulers live in the
same process, it would be theirs too.

Dask runs with its own settings and with QUIET, which docs/sweeps.md recommends: its workers sample
the stack of what they run every 10 ms, and make malloc hand memory back at once.
"""

from __future__ import annotations

import argparse
import tempfile
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import dask
import numpy as np
from distributed import Client, LocalCluster
from measure import VARIED, table, versions
from numpy.typing import NDArray

from drake_racket import Progress, Scenario
from drake_racket.sweep import Sweep, make_sweep, run_sweep

SWEEPS = 20
FIRST = 2  # cases finished when a rate begins: both workers have had one
WAYS = ("1 process", "2 processes", "Dask, as it comes", "Dask, quiet")
QUIET = {
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": 1_000_000_000,
}


def part(cases: int, number: int, after: float) -> Sweep:
    """A Latin hypercube over what users vary; `number` is its seed."""
    keys = {name: {"from": a, "to": b, "unit": unit} for name, (a, b, unit) in VARIED.items()}
    design = {"design": "latin_hypercube", "samples": cases, "seed": number, "keys": keys}
    base = Scenario(audit=False, point="auto", after=after, engine="drake")
    return make_sweep(base, {"sample": design})


def resident() -> float:
    """Memory of this process (MB), from /proc."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


class Clock:
    """Times a sweep: as a whole, and the rate at which cases finish."""

    def __init__(self) -> None:
        self.done: list[tuple[int, float]] = []
        self.start = perf_counter()

    def __call__(self, progress: Progress) -> None:
        """Takes note of a sweep's progress."""
        if progress.task != "running" or progress.done == 0:
            return
        self.done.append((progress.done, perf_counter()))

    def seconds(self) -> float:
        """Since the sweep was started."""
        return perf_counter() - self.start

    def rate(self) -> float:
        """Cases per second from case FIRST on."""
        counted = [entry for entry in self.done if entry[0] >= FIRST]
        (first, begin), (last, end) = counted[0], counted[-1]
        return (last - first) / (end - begin)


def two_workers(stack: ExitStack, settings: dict[str, Any]) -> Client:
    """A client of a local cluster with these settings, until the stack ends."""
    options = {"processes": True, "threads_per_worker": 1, "dashboard_address": None}
    with dask.config.set(settings):
        cluster = stack.enter_context(LocalCluster(n_workers=2, **options))
    return stack.enter_context(Client(cluster, set_as_default=False))


def main() -> None:
    formatter = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=formatter)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--after", type=float, default=0.05, help="s simulated from touch on")
    parser.add_argument("--no-dask", action="store_true", help="own processes only")
    parser.add_argument("--memory", action="store_true", help="of one sweep in this process")
    arguments = parser.parse_args()
    if arguments.memory:
        report_memory(part(arguments.cases, 0, arguments.after))
        return
    size = max(6, arguments.cases // SWEEPS)
    ways_run = WAYS[:2] if arguments.no_dask else WAYS
    seconds = {name: np.zeros(SWEEPS) for name in ways_run}
    rates = {name: np.zeros(SWEEPS) for name in ways_run}
    equal = True
    with ExitStack() as stack:
        calls: list[dict[str, Any]] = [{}, {"workers": 2}]
        if not arguments.no_dask:
            calls += [{"scheduler": two_workers(stack, settings)} for settings in ({}, QUIET)]
        ways = {name: partial(run_sweep, **call) for name, call in zip(WAYS, calls, strict=False)}
        for run in ways.values():  # imports and compilation, once
            with tempfile.TemporaryDirectory() as out:
                run(part(8, 10_000, arguments.after), Path(out))
        for number in range(SWEEPS):
            sweep, results = part(size, number, arguments.after), []
            for name in np.roll(list(ways), number).tolist():
                with tempfile.TemporaryDirectory() as out:
                    clock = Clock()
                    results.append(ways[name](sweep, Path(out), progress=clock))
                    seconds[name][number], rates[name][number] = clock.seconds(), clock.rate()
            equal &= all(result.identical(results[0]) for result in results)
    report(seconds, rates, size * SWEEPS, equal)


def ratio(rates: NDArray[np.float64], to: NDArray[np.float64]) -> str:
    """Ratio of medians over the sweeps, with its bootstrapped 95 % interval."""
    drawn = np.random.default_rng(0).integers(SWEEPS, size=(10_000, SWEEPS))
    ratios = np.median(rates[drawn], axis=1) / np.median(to[drawn], axis=1)
    low, high = np.percentile(ratios, [2.5, 97.5])
    return f"{np.median(rates) / np.median(to):.2f} ({low:.2f} to {high:.2f})"


def report(
    seconds: dict[str, NDArray[np.float64]],
    rates: dict[str, NDArray[np.float64]],
    cases: int,
    equal: bool,
) -> None:
    """Prints the tables."""
    print(versions("distributed"))
    alone, own, *clusters = seconds
    rows = [
        [
            name,
            f"{seconds[name].sum():.1f} s",
            f"{seconds[alone].sum() / seconds[name].sum():.2f}x",
            f"{np.median(rates[name]):.2f}",
            ratio(rates[name], rates[alone]),
        ]
        for name in seconds
    ]
    header = ["way", f"{cases} cases, whole", "speed-up", "running, cases/s", "speed-up"]
    print(table(header, rows))
    for name in clusters:
        print(f"{name}, over 2 processes, running: {ratio(rates[name], rates[own])}")
    print(f"results bit-equal: {equal}")


def report_memory(sweep: Sweep) -> None:
    """Runs a sweep in this process and prints its memory."""
    found: list[float] = []

    def remember(progress: Progress) -> None:
        if progress.task == "running" and progress.done:
            found.append(resident())

    with tempfile.TemporaryDirectory() as out:
        run_sweep(sweep, Path(out), progress=remember)
    memory = np.array(found)
    start = min(100, len(memory) // 2)
    growth = memory[start:].max() / memory[start] - 1.0
    print(versions())
    print(
        f"memory: {memory[0]:.0f} MB after the first case, {memory[start]:.0f} MB after {start},"
        f" then up to {100 * growth:+.1f} % over {len(memory) - 1 - start} more"
    )


if __name__ == "__main__":
    main()
