"""Runs a sweep: what is finished stays, what is missing runs, what comes out is labelled."""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_racket.io.errors import InputError, SimulationError, WorkStopped
from drake_racket.io.files import check_directory, directory_error
from drake_racket.io.interrupts import interrupted, noticed, raise_interrupts, undisturbed
from drake_racket.io.progress import Progress, Report
from drake_racket.pool import PoolError, check_workers, leave_if_imported_again
from drake_racket.results.formats import write_history
from drake_racket.sweep.cases import CasePlan, make_plan
from drake_racket.sweep.check import ChecksFailed, compare, in_drake, sample
from drake_racket.sweep.cluster import ClusterLost, connected
from drake_racket.sweep.export import OWN_VARIABLES, make_dataset, write_results
from drake_racket.sweep.identity import fingerprint
from drake_racket.sweep.runner import Outcomes, run_cases
from drake_racket.sweep.spec import Sweep
from drake_racket.sweep.store import SweepStore, case_rows, check_rows, remove_sweep
from drake_racket.sweep.worker import CaseOutcome, failed

if TYPE_CHECKING:
    import distributed
    import xarray


class SweepStopped(SimulationError, WorkStopped):
    """The sweep cannot go on, for a reason that lies in no case."""


def run_sweep(
    sweep: Sweep,
    out: str | Path | None = None,
    *,
    workers: int = 1,
    scheduler: str | distributed.Client | None = None,
    fresh: bool = False,
    strict: bool = False,
    progress: Report | None = None,
) -> xarray.Dataset:
    """Runs what is missing of a sweep and returns all of it.

    The results depend on the sweep alone: not on executor, order, number of workers, or how often
    it was interrupted. Where processes are spawned (see `pool`), a script that calls this needs
    the usual `if __name__ == "__main__":`.

    Args:
        sweep: see `make_sweep` and `load_sweep`.
        out: directory for the durable results; None keeps nothing.
        workers: processes of this machine; 1 works in this one, unless the sweep needs more than
            `runner.MOST_BUILDS` Diagrams: then in one spawned process at a time, which is replaced
            as it wears out.
        scheduler: of a Dask cluster, instead of own processes: its address, or a client.
        fresh: delete what `out` has of another sweep, or of this one.
        strict: refuse the sweep if any case is not valid, and stop with the exception of the first
            case that fails, instead of keeping the reason in its row.
        progress: called with how far it is: `checking`, then `running` cases.

    Returns:
        A Dataset; see `export.make_dataset`.

    Raises:
        InputError: before any case runs: the sweep is not valid, or `out` has another one.
        ChecksFailed: the sample of cases that ran in Drake once more (`check`) differs by more
            than the sweep's tolerance. The results are in `out`.
        SweepStopped: processes cannot be started, the Dask scheduler went away, or `out` cannot be
            written any more. What is finished is in `out`.
        KeyboardInterrupt: on Ctrl-C (and SIGTERM within `io.interrupts.terminable`), after the
            results so far are written.

    """
    out = None if out is None else Path(out)
    leave_if_imported_again()
    check_workers(workers)
    if scheduler is not None and workers != 1:
        raise InputError(
            "workers", workers, "nothing beside a scheduler, whose cluster has its own"
        )
    if out is None and sweep.histories:
        raise InputError("histories", f"{len(sweep.histories)} cases", "none without a directory")
    if out is not None:
        check_directory(out, "--out")
    report = progress or (lambda _: None)
    start = time.monotonic()
    with contextlib.ExitStack() as stack:
        stack.enter_context(noticed())
        client = None if scheduler is None else stack.enter_context(connected(scheduler))
        plan = make_plan(
            sweep,
            lambda n: report(Progress("checking", n, len(sweep), seconds=time.monotonic() - start)),
            strict=strict,
        )
        store = stack.enter_context(contextlib.closing(_open(sweep, plan, out, fresh)))
        outcomes: Callable[[Sequence[int]], Outcomes] = lambda cases: run_cases(  # noqa: E731
            sweep, plan, cases, workers=workers, client=client, strict=strict
        )
        try:
            try:
                _run_missing(sweep, plan, store, out, outcomes, report)
                _run_checks(sweep, plan, store, workers, client, report)
            except KeyboardInterrupt:
                with undisturbed():
                    _results(sweep, store, out)
                raise
            dataset = _results(sweep, store, out)
        except (PoolError, ClusterLost) as error:
            raise _stopped(str(error), sweep, out, store) from None
        except BrokenPipeError:  # of the caller's progress
            raise
        except OSError as error:
            raise _stopped(f"{out} cannot be written ({error})", sweep, out, store) from None
        comparison = compare(sweep, list(case_rows(store)), list(check_rows(store)))
    if comparison is not None and not comparison.passes():
        where = "" if out is None else f"; the results are in {out}"
        raise ChecksFailed(f"the sweep is not what Drake computes: {comparison.text()}{where}")
    return dataset


def run_grid(
    sweep: Sweep, *, title: str, workers: int = 1, progress: Report | None = None
) -> xarray.Dataset:
    """Runs a rig's sweep, in memory, with nothing but its outputs over its axes.

    Args:
        sweep: every case must be valid, and finish.
        title: of the Dataset.
        workers, progress: as for `run_sweep`; it is not called while cases are checked.

    Returns:
        A Dataset with one variable per output; the attribute `warnings` (JSON) counts what the
        runs had to say, `scenario` is the base.

    Raises:
        InputError: a case is not valid; before any case runs.
        SimulationError: a run could not be finished.

    """

    def running(now: Progress) -> None:
        if progress is not None and now.task == "running":
            progress(now)

    dataset = run_sweep(sweep, workers=workers, strict=True, progress=running)
    found = dataset.drop_vars([name for name in OWN_VARIABLES if name in dataset])
    found.attrs["title"] = title
    return found


def _open(sweep: Sweep, plan: CasePlan, out: Path | None, fresh: bool) -> SweepStore:
    header: dict[str, Any] = fingerprint(sweep, plan.files) | {"scenario_hashes": plan.hashes}
    try:
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
            if fresh:
                remove_sweep(out)
        return SweepStore(out, header, sweep.outputs)
    except OSError as error:
        raise directory_error(out or Path(), error, "--out") from None


def _results(sweep: Sweep, store: SweepStore, out: Path | None) -> xarray.Dataset:
    dataset = make_dataset(sweep, store)
    if out is not None:
        write_results(dataset, out)
    return dataset


def _stopped(reason: str, sweep: Sweep, out: Path | None, store: SweepStore) -> SweepStopped:
    count = f"after {len(store.finished())} of {len(sweep)} cases"
    kept = (
        "nothing is kept" if out is None else "they are kept: the same command goes on from there"
    )
    return SweepStopped(f"{reason} {count}; {kept}")


def _run_missing(
    sweep: Sweep,
    plan: CasePlan,
    store: SweepStore,
    out: Path | None,
    run: Callable[[Sequence[int]], Outcomes],
    report: Report,
) -> None:
    finished = store.finished()
    count = len(sweep.outputs)
    refused = [failed(c, count, text) for c, text in plan.invalid.items() if c not in finished]
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
    done = 0
    with contextlib.closing(run(missing)) as outcomes:
        for batch in _kept(outcomes, sweep, out):
            if interrupted():  # a library may have made the signal the case's own failure
                batch = [outcome for outcome in batch if not outcome.failure]
            store.record(batch, plan.hashes)
            raise_interrupts()
            done += len(batch)
            failures += sum(bool(outcome.failure) for outcome in batch)
            tell(done)


def _run_checks(
    sweep: Sweep,
    plan: CasePlan,
    store: SweepStore,
    workers: int,
    client: distributed.Client | None,
    report: Report,
) -> None:
    """Runs some of the cases in Drake once more, as `check` has it."""
    finished = [case for case, failed in store.finished().items() if not failed]
    have = {row.case for row in check_rows(store)}
    cases = [case for case in sample(sweep, finished) if case not in have]
    if not cases:
        return
    drake, start = in_drake(sweep), time.monotonic()
    outcomes = run_cases(drake, plan, cases, workers=min(workers, len(cases)), client=client)
    done = 0
    with contextlib.closing(outcomes):
        for batch in outcomes:
            if interrupted():
                batch = [outcome for outcome in batch if not outcome.failure]
            store.record_checks(batch)
            raise_interrupts()
            done += len(batch)
            seconds = time.monotonic() - start
            report(Progress("comparing", done, len(cases), seconds=seconds))


def _is_finished(case: int, finished: dict[int, bool], sweep: Sweep, out: Path | None) -> bool:
    """A case whose history was deleted is missing."""
    if case not in finished:
        return False
    if out is None or finished[case] or case not in sweep.histories:
        return True
    return all(path.exists() for path in history_paths(case, sweep, out))


def history_paths(case: int, sweep: Sweep, out: str | Path) -> list[Path]:
    """Tells where a case's time history is, or would be."""
    out = Path(out)
    return [out / "histories" / f"case_{case:06d}.{suffix}" for suffix in sweep.history_formats]


def _kept(outcomes: Outcomes, sweep: Sweep, out: Path | None) -> Iterator[list[CaseOutcome]]:
    """The batches, with their histories written: a row says that all of its case is there.

    A case whose history its format cannot hold has failed.
    """
    for batch in outcomes:
        kept = []
        for outcome in batch:
            try:
                if outcome.data is not None and out is not None:
                    for path in history_paths(outcome.case, sweep, out):
                        path.parent.mkdir(exist_ok=True)
                        write_history(outcome.data, path)
            except InputError as error:
                count, reason = len(sweep.outputs), f"history: {error}"
                outcome = failed(outcome.case, count, reason, outcome.seconds)
            kept.append(dataclasses.replace(outcome, data=None))
        yield kept
