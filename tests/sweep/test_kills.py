"""Sweeps under kill -9: of the main process, of workers, of a Dask scheduler. 20 kills in all."""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import os
import random
import signal
import sqlite3
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from drake_racket import Scenario
from drake_racket.io.fingerprint import as_text, computation
from drake_racket.pool import MOST_DEATHS
from drake_racket.results.outputs import find_outputs
from drake_racket.sweep import SweepStopped, make_sweep, run_sweep
from drake_racket.sweep.runner import _run_in_pool
from drake_racket.sweep.worker import CaseOutcome, CaseSettings, CaseTask

BASE = Scenario(
    support="clamped_head", audit=False, approach_time=1e-4, after=0.002, engine="drake"
)
AXES = {
    "speed": {"from": 18.0, "to": 33.0, "count": 6, "unit": "m/s"},
    "point": [1, 8],
    # 1 in 4 is aimed beside the rim
    "aim": {
        "keys": {"offset_x": {"unit": "m"}, "offset_y": {"unit": "m"}},
        "rows": [[0.001 * i, 0.0] for i in range(3)] + [[0.12, 0.0]],
    },
}


@pytest.fixture(scope="module")
def sweep():
    return make_sweep(BASE, AXES, histories=[7])


@pytest.fixture(scope="module")
def reference(sweep, tmp_path_factory):
    """The undisturbed run: its rows and its Dataset."""
    out = tmp_path_factory.mktemp("undisturbed")
    dataset = run_sweep(sweep, out)
    return rows(out), dataset


def rows(out: Path) -> dict[int, tuple]:
    """What is in the store now, but for the time that cases took."""
    if not (out / "sweep.sqlite").exists():
        return {}
    with contextlib.closing(sqlite3.connect(out / "sweep.sqlite", timeout=30.0)) as database:
        tables = database.execute("SELECT name FROM sqlite_master").fetchall()
        if not tables:
            return {}
        assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        found = database.execute("SELECT * FROM cases").fetchall()
    return {row[0]: row[1:5] + row[6:] for row in found}


def check_kept(out: Path, before: dict[int, tuple], reference: dict[int, tuple]) -> None:
    after = rows(out)
    assert before.items() <= after.items()  # nothing finished is lost
    assert after.items() <= reference.items()  # no half row, no other number
    assert 7 not in after or (out / "histories" / "case_000007.nc").exists()
    assert not list(out.glob("results.*")) or (out / "results.nc").exists()


def start(sweep, out: Path, workers: int):
    """The main process: forked, since importing everything anew would take most of the time."""
    process = multiprocessing.get_context("fork").Process(
        target=run_sweep, args=(sweep, out), kwargs={"workers": workers}
    )
    process.start()
    return process


@pytest.mark.slow
def test_main_process_killed_12_times(sweep, reference, tmp_path):
    chance = random.Random(1)
    kills, rounds = 0, 0
    while kills < 12:
        out = tmp_path / str(rounds)
        process = start(sweep, out, 1)
        time.sleep(chance.uniform(0.0, 0.7))
        before = rows(out)
        if process.is_alive():
            os.kill(process.pid, signal.SIGKILL)
            kills += 1
        else:
            rounds += 1
        process.join()
        check_kept(out, before, reference[0])
    for done in range(rounds + 1):
        assert run_sweep(sweep, tmp_path / str(done)).identical(reference[1])


@pytest.mark.slow
def test_main_process_of_two_workers_killed_twice(sweep, reference, tmp_path):
    chance = random.Random(2)
    for _ in range(2):
        process = start(sweep, tmp_path, 2)
        seen = len(rows(tmp_path))
        wait_for(lambda seen=seen: len(rows(tmp_path)) > seen)
        time.sleep(chance.uniform(0.0, 0.3))
        before, workers = rows(tmp_path), children(process.pid)
        os.kill(process.pid, signal.SIGKILL)
        process.join()
        check_kept(tmp_path, before, reference[0])
        wait_for(lambda workers=workers: not any(Path(f"/proc/{pid}").exists() for pid in workers))
    assert run_sweep(sweep, tmp_path).identical(reference[1])


@pytest.mark.exhaustive
def test_workers_killed_three_times(sweep, reference, tmp_path):
    chance = random.Random(3)
    kills: list[int] = []
    done = [0]

    def kill() -> None:
        while len(kills) < 3:
            seen = done[0]
            wait_for(lambda seen=seen: done[0] > seen)
            time.sleep(chance.uniform(0.0, 0.1))
            pid = chance.choice(multiprocessing.active_children()).pid
            os.kill(pid, signal.SIGKILL)
            kills.append(pid)

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()

    def progress(now) -> None:
        if now.task == "running":
            done[0] = now.done - now.before

    dataset = run_sweep(sweep, tmp_path, workers=2, progress=progress)
    assert dataset.identical(reference[1])
    assert len(kills) == 3


@pytest.mark.exhaustive
def test_dask_scheduler_killed_twice_and_a_worker_once(sweep, reference, tmp_path):
    distributed = pytest.importorskip("distributed")
    chance = random.Random(4)
    out = tmp_path / "out"
    for victim in ("scheduler", "scheduler", "worker"):
        with dask_cluster(tmp_path) as (scheduler, address):
            seen = len(rows(out))
            before: dict[int, tuple] = {}

            def kill(victim=victim, scheduler=scheduler, address=address, seen=seen, before=before):
                wait_for(lambda: len(rows(out)) > max(seen, 12) + 2)  # 12 are not valid
                time.sleep(chance.uniform(0.0, 0.1))
                before.update(rows(out))
                pid = scheduler.pid
                if victim == "worker":
                    with distributed.Client(address, set_as_default=False) as client:
                        (pid,) = client.run(os.getpid).values()
                os.kill(pid, signal.SIGKILL)

            killer = threading.Thread(target=kill)
            killer.start()
            if victim == "scheduler":
                with pytest.raises(SweepStopped, match=r"goes on from there") as error:
                    run_sweep(sweep, out, scheduler=address)
                assert "\n" not in str(error.value)
            else:
                assert run_sweep(sweep, out, scheduler=address).identical(reference[1])
            killer.join()
            assert before
            check_kept(out, before, reference[0])
    assert run_sweep(sweep, out).identical(reference[1])


def die_or_live(tasks: list[CaseTask]) -> list[CaseOutcome]:
    """Stands for run_chunk: case 17 is the end of its process."""
    if 17 in [task.case for task in tasks]:
        os.kill(os.getpid(), signal.SIGKILL)
    return [CaseOutcome(task.case, [float(task.case)], seconds=0.01) for task in tasks]


@pytest.mark.slow
def test_a_case_that_kills_its_process_becomes_a_failed_row(monkeypatch):
    monkeypatch.setattr("drake_racket.sweep.runner.run_chunk", die_or_live)
    settings = CaseSettings(find_outputs(["kb"], "outputs"), computation(), {})
    tasks = [CaseTask(case, BASE, as_text({}), settings) for case in range(40)]
    found = {o.case: o for batch in _run_in_pool(tasks, 1, strict=False) for o in batch}
    assert sorted(found) == list(range(40))  # its chunk's others are none the worse
    assert [case for case, o in found.items() if o.failure] == [17]
    assert f"process died {MOST_DEATHS} times" in found[17].failure


def wait_for(condition, seconds: float = 300.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def children(pid: int) -> list[int]:
    """The processes that a process has started, but for multiprocessing's resource tracker."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            parent = int(path.read_text().rsplit(")", 1)[1].split()[1])
            spawned = b"spawn_main" in (path.parent / "cmdline").read_bytes()
            if parent == pid and spawned:
                found.append(int(path.parent.name))
    assert found
    return found


@contextlib.contextmanager
def dask_cluster(directory: Path):
    """A scheduler and a worker as processes of their own."""
    file = directory / "scheduler.json"
    file.unlink(missing_ok=True)
    run = [sys.executable, "-m"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    place = ["--no-dashboard", "--scheduler-file", str(file)]
    scheduler = subprocess.Popen(
        [*run, "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", *place],
        **quiet,
    )
    worker = subprocess.Popen(
        [
            *run,
            "distributed.cli.dask_worker",
            *place,
            "--nthreads",
            "1",
            "--local-directory",
            str(directory),
        ],
        **quiet,
    )
    try:
        wait_for(file.exists)
        wait_for(lambda: file.read_text().strip().endswith("}"))
        yield scheduler, json.loads(file.read_text())["address"]
    finally:
        for process in (worker, scheduler):
            process.terminate()
            process.wait()
