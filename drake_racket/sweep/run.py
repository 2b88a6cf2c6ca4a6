"""Runs a sweep: what is finished stays, what is missing runs, what comes out is labelled."""

from __future__ import annotations

import dataclasses
import json
import sqlite3
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_racket.io.errors import InputError
from drake_racket.io.files import check_directory, directory_error
from drake_racket.io.fingerprint import environment
from drake_racket.results.formats import write_history
from drake_racket.rigs.cases import check_workers
from drake_racket.sweep.cases import Plan, make_plan
from drake_racket.sweep.cluster import run_on_cluster
from drake_racket.sweep.executors import MOST_BUILDS, run_here, run_in_processes
from drake_racket.sweep.export import make_dataset, write_results
from drake_racket.sweep.identity import as_text, fingerprint
from drake_racket.sweep.spec import Sweep
from drake_racket.sweep.store import Store, remove_sweep
from drake_racket.sweep.worker import Outcome, Settings, SweepStopped, Task, failed

if TYPE_CHECKING:
    import distributed
    import xarray


@dataclass(frozen=True)
class Progress:
    """How far a sweep is.

    Attributes:
        phase: `checking` or `running`.
        done, total: cases.
        failed: of those done.
        before: of those done, how many an earlier run has left.
        seconds: since this phase began.

    """

    phase: str
    done: int
    total: int
    failed: int = 0
    before: int = 0
    seconds: float = 0.0

    def rate(self) -> float:
        """Cases per second of this run; 0 before the first."""
        return (self.done - self.before) / self.seconds if self.seconds > 0.0 else 0.0

    def time_left(self) -> float | None:
        """Seconds at this rate; None before the first case."""
        rate = self.rate()
        return (self.total - self.done) / rate if rate > 0.0 else None


def run_sweep(
    sweep: Sweep,
    out: Path | None = None,
    *,
    workers: int = 1,
    scheduler: str | distributed.Client | None = None,
    fresh: bool = False,
    progress: Callable[[Progress], None] | None = None,
) -> xarray.Dataset:
    """Runs what is missing of a sweep and returns all of it.

    The results depend on the sweep alone: not on executor, order, number of workers, or how often
    it was interrupted. Where processes are spawned (see `workers`), a script that calls this needs
    the usual `if __name__ == "__main__":`.

    Args:
        sweep: see `make_sweep` and `load_sweep`.
        out: directory for the durable results; None keeps nothing.
        workers: processes of this machine; 1 works in this one, unless the sweep needs more than
            `executors.MOST_BUILDS` Diagrams: then in one spawned process at a time, which is
            replaced as it wears out.
        scheduler: of a Dask cluster, instead of own processes: its address, or a client.
        fresh: delete what `out` has of another sweep, or of this one.
        progress: called with how far it is.

    Returns:
        A Dataset; see `export.make_dataset`.

    Raises:
        InputError: before any case runs: the sweep is not valid, or `out` has another one.
        SweepStopped: the Dask scheduler went away, or `out` cannot be written any more. What is
            finished is in `out`.
        KeyboardInterrupt: on Ctrl-C, after the results so far are written.

    """
    check_workers(workers)
    if scheduler is not None and workers != 1:
        raise InputError(
            "workers", workers, "nothing beside a scheduler, whose cluster has its own"
        )
    report = progress or (lambda _: None)
    start = time.monotonic()
    if out is None and sweep.histories:
        raise InputError("histories", f"{len(sweep.histories)} cases", "none without a directory")
    if out is not None:
        check_directory(out, "--out")
    plan = make_plan(
        sweep,
        lambda n: report(Progress("checking", n, len(sweep), seconds=time.monotonic() - start)),
    )
    identity: dict[str, Any] = json.loads(as_text(fingerprint(sweep, plan.files)))
    try:
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
            if fresh:
                remove_sweep(out)
        store = Store(out, identity, plan.hashes, sweep.outputs)
    except OSError as error:
        raise directory_error(out or Path(), error, "--out") from None

    def results() -> xarray.Dataset:
        dataset = make_dataset(sweep, store, identity, plan.hashes)
        if out is not None:
            write_results(dataset, out)
        return dataset

    try:
        try:
            _run_missing(sweep, plan, store, out, _executor(plan, workers, scheduler), report)
        except KeyboardInterrupt:
            results()
            raise
        return results()
    except (SweepStopped, OSError, sqlite3.Error) as error:
        raise _stopped(error, sweep, out, store) from None
    finally:
        store.close()


def _stopped(error: Exception, sweep: Sweep, out: Path | None, store: Store) -> SweepStopped:
    reason = str(error) if isinstance(error, SweepStopped) else f"{out} cannot be written ({error})"
    count = f"after {len(store.finished())} of {len(sweep)} cases"
    kept = (
        "nothing is kept" if out is None else "they are kept: the same command goes on from there"
    )
    return SweepStopped(f"{reason} {count}; {kept}")


Executor = Callable[[Iterable[Task]], Generator[list[Outcome], None, None]]


def _executor(plan: Plan, workers: int, scheduler: str | distributed.Client | None) -> Executor:
    if scheduler is not None:
        return lambda tasks: run_on_cluster(tasks, scheduler)
    if workers == 1 and len(plan.builders) <= MOST_BUILDS:
        return run_here
    return lambda tasks: run_in_processes(tasks, workers)


def _run_missing(
    sweep: Sweep,
    plan: Plan,
    store: Store,
    out: Path | None,
    execute: Executor,
    report: Callable[[Progress], None],
) -> None:
    names = tuple(output.name for output in sweep.outputs)
    finished = store.finished()
    refused = [failed(c, names, text) for c, text in plan.invalid.items() if c not in finished]
    if refused:
        store.record(refused, plan.hashes)
        finished = store.finished()
    missing = [case for case in plan.order() if not _is_finished(case, finished, sweep, out)]
    before, failures = len(sweep) - len(missing), sum(finished.values())
    start = time.monotonic()

    def tell(count: int) -> None:
        seconds = time.monotonic() - start
        report(Progress("running", before + count, len(sweep), failures, before, seconds))

    tell(0)
    outcomes = execute(_tasks(sweep, plan, names, missing))
    count = 0
    try:
        for batch in outcomes:
            # histories first: a row says that all of its case is there
            batch = _with_histories(batch, sweep, out)
            store.record(batch, plan.hashes)
            count += len(batch)
            failures += sum(bool(outcome.failure) for outcome in batch)
            tell(count)
    finally:
        outcomes.close()


def _tasks(
    sweep: Sweep, plan: Plan, names: tuple[str, ...], cases: Sequence[int]
) -> Iterator[Task]:
    settings = Settings(names, environment(), plan.files)
    builders = [as_text(dataclasses.asdict(builder)) for builder in plan.builders]
    for case in cases:
        builder = builders[plan.group[case]]
        yield Task(case, sweep.scenario(case), builder, settings, case in sweep.histories)


def _is_finished(case: int, finished: dict[int, bool], sweep: Sweep, out: Path | None) -> bool:
    """A case whose history was deleted is missing."""
    if case not in finished:
        return False
    if out is None or finished[case] or case not in sweep.histories:
        return True
    return all(path.exists() for path in history_paths(case, sweep, out))


def history_paths(case: int, sweep: Sweep, out: Path) -> list[Path]:
    """Where a case's time history is, or would be."""
    return [out / "histories" / f"case_{case:06d}.{suffix}" for suffix in sweep.history_formats]


def _with_histories(batch: Sequence[Outcome], sweep: Sweep, out: Path | None) -> list[Outcome]:
    """Writes the batch's histories; a case whose history its format cannot hold has failed."""
    kept = []
    for outcome in batch:
        try:
            if outcome.history is not None and out is not None:
                for path in history_paths(outcome.case, sweep, out):
                    path.parent.mkdir(exist_ok=True)
                    write_history(outcome.history, path)
        except InputError as error:
            names = tuple(output.name for output in sweep.outputs)
            outcome = failed(outcome.case, names, f"history: {error}", outcome.seconds)
        kept.append(outcome)
    return kept
