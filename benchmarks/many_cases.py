"""A million cases of a Sobol design, in threads or on a local Dask cluster: rate, memory, bits.

    python benchmarks/many_cases.py DIR --cases 131072             # in this process and its threads
    python benchmarks/many_cases.py DIR --dask 2                   # 1,048,576 cases, two workers
    python benchmarks/many_cases.py DIR --dask 2 --beside OTHER    # and compares every bit

Free impacts, 10 ms from touch, anywhere near the centre, with what users vary (extras `fast` and
`dask`; half an hour for each million on two quiet cores, and it goes on where it was stopped). A
sequence of Sobol's begins alike however long it is: OTHER may have fewer cases.
"""

from __future__ import annotations

import contextlib
import os
import sqlite3
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Annotated, Any

import typer
from measure import VARIED, table, versions

from drake_racket import Progress, Scenario
from drake_racket.sweep import Sweep, make_sweep, run_sweep

OUTPUTS = ["rebound_speed", "restitution", "contact_time", "peak_normal_force"]
EVERY = 2**15  # cases between rows of the table


def design(cases: int) -> Sweep:
    """The first cases of the sequence."""
    keys = {name: {"from": a, "to": b, "unit": unit} for name, (a, b, unit) in VARIED.items()}
    axis = {"design": "sobol", "samples": cases, "seed": 1, "keys": keys}
    base = Scenario(audit=False, point="auto", after=0.01, approach_time=1e-4)
    return make_sweep(base, {"row": axis}, OUTPUTS, check={"most": 5})


class Watch:
    """Takes note of time and memory as cases finish."""

    def __init__(self, client: Any) -> None:
        self._client, self._since, self._last = client, time.monotonic(), -EVERY
        self._begun: tuple[float, int] | None = None
        self.rows: list[list[str]] = []
        self.rate = 0.0

    def __call__(self, progress: Progress) -> None:
        """Adds a row each EVERY cases."""
        now = time.monotonic()
        if progress.task == "running":
            self._begun = self._begun or (now, progress.done)
            began, first = self._begun
            self.rate = (progress.done - first) / max(now - began, 1e-9)
        ended = progress.done in (0, progress.total)
        if progress.done - self._last < EVERY and not (ended and progress.task == "running"):
            return
        self._last = progress.done if progress.task == "running" else -EVERY
        if progress.task != "running":
            return
        row = [f"{progress.done}", f"{now - self._since:.0f}", f"{self.rate:.0f}"]
        row.append(f"{memory(os.getpid()):.0f}")
        if self._client is not None:
            workers = self._client.scheduler_info()["workers"].values()
            row.append(", ".join(f"{worker['metrics']['memory'] / 1e6:.0f}" for worker in workers))
        self.rows.append(row)
        print(*row, file=sys.stderr, flush=True)


def memory(pid: int) -> float:
    """Megabytes that a process has."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


@contextlib.contextmanager
def cluster(workers: int) -> Iterator[Any]:
    """A client of so many processes of one thread each; None of 0."""
    if not workers:
        yield None
        return
    import dask
    from distributed import Client, LocalCluster

    quiet = {
        "distributed.worker.profile.enabled": False,
        "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": 1_000_000_000,
    }
    with (
        dask.config.set(quiet),
        LocalCluster(workers, threads_per_worker=1, dashboard_address=None) as local,
        Client(local) as client,
    ):
        yield client


def differing(one: Path, other: Path) -> tuple[int, int]:
    """Counts the cases that both directories have, and those of them of which any bit differs."""
    columns = ", ".join(f'"{name}"' for name in OUTPUTS)
    with closing(sqlite3.connect(one / "sweep.sqlite")) as store:
        store.execute("ATTACH ? AS other", (str(other / "sweep.sqlite"),))
        joined = 'cases JOIN other.cases AS others USING ("case")'
        (both,) = store.execute(f"SELECT count(*) FROM {joined}").fetchone()
        rows = f'SELECT "case", failure, {columns} FROM'
        (apart,) = store.execute(
            f'SELECT count(*) FROM ({rows} cases WHERE "case" IN'
            f' (SELECT "case" FROM other.cases) EXCEPT {rows} other.cases)'
        ).fetchone()
    return both, apart


def main(
    out: Annotated[Path, typer.Argument(help="for the sweep's results")],
    cases: Annotated[int, typer.Option(help="a power of 2")] = 2**20,
    dask: Annotated[int, typer.Option(help="workers; 0 for threads of this process")] = 0,
    beside: Annotated[Path | None, typer.Option(help="results of another run")] = None,
) -> None:
    """Runs and prints."""
    print(f"## {versions('numba')}\n")
    sweep = design(cases)
    with cluster(dask) as client:
        watch = Watch(client)
        run_sweep(sweep, out, scheduler=client, progress=watch)
    header = ["cases", "s", "cases a second", "MB", "MB of each worker"]
    print(table(header if dask else header[:-1], watch.rows))
    if beside is not None:
        both, apart = differing(out, beside)
        print(f"\n{both} cases in both, {apart} of them differ")


if __name__ == "__main__":
    typer.run(main)
