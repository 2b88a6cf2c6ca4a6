"""How the pool of processes shares tasks and takes deaths, with processes that are stood for."""

from __future__ import annotations

import os
import sys
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from types import SimpleNamespace
from typing import Any

import pytest

from drake_racket import pool
from drake_racket.pool import PoolError, check_workers, run_in_processes


class Process:
    """Stands for a process; counts how often it is ended."""

    def __init__(self, exitcode: int | None) -> None:
        self.exitcode, self.ended = exitcode, 0

    def terminate(self) -> None:
        """Ends it."""
        self.ended += 1


class Machine:
    """Stands for executors: a task is done, or its process dies, when the pool waits.

    Attributes:
        deadly: tasks that end their process.
        starts: whether each executor's first process comes up; the last one stands for the rest.
        log: what happened: ("start", workers), ("shutdown", wait), tasks that were under way
            when one was done or died.

    """

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.deadly: set[Any] = set()
        self.starts = [True]
        self.log: list[Any] = []
        self.children: list[Any] = []
        self.executor: Any = None
        self.exitcode = None
        machine = self

        class Executor:
            def __init__(self, workers: int, context: Any, initializer: Any) -> None:
                assert context.get_start_method() == "spawn"
                assert initializer is pool._end_with_parent
                machine.log.append(("start", workers))
                self.under_way: dict[Future[Any], Any] = {}
                self.broken = False
                self.up = machine.starts[0]
                if len(machine.starts) > 1:
                    machine.starts.pop(0)
                machine.executor = self
                self.process = Process(machine.exitcode)
                self.first = True

            def submit(self, call: Any, *arguments: Any) -> Future[Any]:
                if self.broken:
                    raise BrokenProcessPool("broken")
                if self.first:
                    machine.children.append(self.process)
                    self.first = False
                future: Future[Any] = Future()
                if call is os.getpid:
                    if self.up:
                        future.set_result(1)
                    else:
                        future.set_exception(BrokenProcessPool("at the start"))
                    return future
                self.under_way[future] = call, arguments[0]
                return future

            def shutdown(self, wait: bool = True, cancel_futures: bool = False) -> None:
                machine.log.append(("shutdown", wait, cancel_futures))

        patch.setattr(pool, "ProcessPoolExecutor", Executor)
        patch.setattr(pool, "wait", self.wait)
        patch.setattr(pool.multiprocessing, "active_children", lambda: list(self.children))

    def wait(self, running: Any, seconds: Any = None, when: Any = None) -> Any:
        """The first task under way is done, or ends all that are."""
        at = self.executor
        if when is not None and at.under_way:
            self.log.append([task for _, task in at.under_way.values()])
            future = next(iter(at.under_way))
            call, task = at.under_way.pop(future)
            if task in self.deadly or not at.up:
                at.broken = True
                for one in (future, *at.under_way):
                    one.set_exception(BrokenProcessPool("died"))
                at.under_way.clear()
                return [future], []
            future.set_result(call(task))
        return [one for one in running if one.done()], []


@pytest.fixture
def machine(monkeypatch):
    return Machine(monkeypatch)


def square(number: int) -> int:
    return number * number


def results(*arguments: Any, **options: Any) -> dict[Any, Any]:
    return dict(one for batch in run_in_processes(*arguments, **options) for one in batch)


def under_way(machine: Machine) -> list[Any]:
    return [one for one in machine.log if isinstance(one, list)]


def test_two_tasks_a_process_are_handed_out(machine):
    taken = []
    tasks = (taken.append(n) or n for n in range(7))
    assert results(square, tasks, 2) == {n: n * n for n in range(7)}
    assert [len(one) for one in under_way(machine)] == [4, 4, 4, 4, 3, 2, 1]
    assert machine.log[0] == ("start", 2)
    assert machine.log[-1] == ("shutdown", False, True)
    assert machine.executor.process.ended == 0


def test_one_that_dies_again_and_again_is_given_up_and_pays_alone(machine):
    machine.deadly = {1}
    found = results(square, range(5), 2, died=lambda task, reason: f"{task}: {reason}")
    reason = "its process died 3 times (killed, or out of memory)"
    assert found == {0: 0, 1: f"1: {reason}", 2: 4, 3: 9, 4: 16}
    seen = under_way(machine)
    # twice with others, then three times alone
    assert [one for one in seen if one[0] == 1][:2] == [[1, 2, 3, 4], [1, 2, 3, 4]]
    assert seen.count([1]) == 3
    assert machine.log.count(("start", 2)) == 6


def test_without_a_result_for_it_it_is_an_error_with_its_number(machine):
    machine.deadly = {5}
    with pytest.raises(PoolError, match=r"^task 2 cannot be done: its process died 3 times"):
        results(square, [4, 5], 1)


def test_a_task_of_many_parts_is_taken_apart(machine):
    machine.deadly = {(1, 2, 3), (2,)}
    found = results(
        sum,
        [(1, 2, 3), (4, 5)],
        1,
        died=lambda task, reason: "dead",
        split=lambda task: [(n,) for n in task],
    )
    assert found == {(1,): 1, (2,): "dead", (3,): 3, (4,): 4, (5,): 5}
    seen = under_way(machine)
    assert seen[:2] == [[(1, 2, 3), (4, 5)]] * 2
    assert all(len(one) == 1 for one in seen[2:])
    assert seen.count([(2,)]) == 3


def test_processes_that_do_not_start_cost_no_task(machine):
    machine.starts = [False, False, True]
    assert results(square, [3], 1) == {3: 9}
    assert machine.log.count(("start", 1)) == 3


def test_processes_that_never_start_are_an_error(machine):
    machine.starts = [False]
    with pytest.raises(PoolError, match="die as they start"):
        results(square, [3], 1)
    assert machine.log.count(("start", 1)) == 3


def test_bad_starts_are_counted_from_the_last_good_one(machine):
    """A death in a task between them says that processes can start."""
    machine.deadly = {3}
    machine.starts = [False, False, True, False, False, True]
    assert results(square, [3], 1, died=lambda task, reason: "dead") == {3: "dead"}


def test_a_script_without_main_guard_is_told(machine):
    machine.exitcode, machine.starts = 86, [False]
    with pytest.raises(PoolError, match="__main__"):
        results(square, [3], 1)


def test_worn_processes_are_replaced_when_nothing_is_under_way(machine):
    found = results(square, range(5), 1, worn=lambda result: result == 1)
    assert found == {n: n * n for n in range(5)}
    assert under_way(machine) == [[0, 1], [1, 2], [2], [3, 4], [4]]
    assert machine.log.count(("start", 1)) == 2


def test_whoever_waits_is_told_that_nothing_has_finished(machine, monkeypatch):
    monkeypatch.setattr(pool, "wait", lambda running, seconds, when: (set(), seconds))
    waits = run_in_processes(square, [1], 1, every=0.5)
    assert [next(waits), next(waits)] == [[], []]
    waits.close()
    assert machine.executor.process.ended == 1
    assert machine.log[-1] == ("shutdown", False, True)


@pytest.mark.parametrize("workers", [1, 256])
def test_workers_that_are_allowed(workers):
    check_workers(workers)


@pytest.mark.parametrize("workers", [257, 0])
def test_workers_that_are_not(workers):
    with pytest.raises(Exception, match="1 to 256 processes"):
        check_workers(workers)


@pytest.mark.parametrize("there", [True, False])
def test_a_script_without_a_file_hides_its_name(there, monkeypatch):
    main = SimpleNamespace(__file__=__file__ if there else "<stdin>")
    monkeypatch.setitem(sys.modules, "__main__", main)
    with pool._without_nameless_main():
        assert hasattr(main, "__file__") == there
    assert main.__file__ == (__file__ if there else "<stdin>")


def test_a_process_that_imports_the_script_again_leaves(monkeypatch):
    left = []
    monkeypatch.setattr(pool.os, "_exit", left.append)
    pool.leave_if_imported_again()
    assert left == []
    again = SimpleNamespace(_inheriting=True)
    monkeypatch.setattr(pool.multiprocessing, "current_process", lambda: again)
    pool.leave_if_imported_again()
    assert left == [86]


def test_a_process_ends_with_its_parent(monkeypatch):
    left, joined = [], []
    monkeypatch.setattr(pool.os, "_exit", left.append)
    parent = SimpleNamespace(join=lambda: joined.append(True))
    monkeypatch.setattr(pool.multiprocessing, "parent_process", lambda: parent)

    class Now:
        def __init__(self, target, daemon):
            assert daemon
            self.start = target

    monkeypatch.setattr(pool.threading, "Thread", Now)
    pool._end_with_parent()
    assert (joined, left) == ([True], [1])
    monkeypatch.setattr(pool.multiprocessing, "parent_process", lambda: None)
    pool._end_with_parent()
    assert left == [1]
