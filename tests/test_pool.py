"""The pool of processes: deaths, signals, scripts without main guard, bad numbers."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from drake_racket import pool
from drake_racket.io.errors import InputError
from drake_racket.pool import MOST_DEATHS, PoolError, check_workers, run_in_processes
from tests.conftest import ROOT

SECONDS = 60.0


def square(number: int) -> int:
    return number * number


def raises(number: int) -> int:
    if number == 1:
        raise InputError("number", number, "another")
    time.sleep(60.0 if number == 0 else 0.0)
    return number


def dies(task: tuple[int, str]) -> int:
    """Task 2 is the end of its process; task 3 of its first one."""
    number, directory = task
    mark = Path(directory) / "died"
    if number == 2 or (number == 3 and not mark.exists()):
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def identity(_: int) -> int:
    return os.getpid()


def test_every_task_has_its_result():
    found = dict(one for batch in run_in_processes(square, range(7), 2) for one in batch)
    assert found == {n: n * n for n in range(7)}


@pytest.mark.slow
def test_what_a_call_raises_ends_the_rest():
    began = time.monotonic()
    with pytest.raises(InputError, match=r"^number: got 1; allowed: another$"):
        list(run_in_processes(raises, range(4), 2))
    assert time.monotonic() - began < 30.0


@pytest.mark.slow
def test_deaths_cost_no_other_task_its_result(tmp_path):
    tasks = [(number, str(tmp_path)) for number in range(5)]
    found = {
        task[0]: result
        for batch in run_in_processes(dies, tasks, 2, died=lambda task, reason: reason)
        for task, result in batch
    }
    assert found.pop(2) == f"its process died {MOST_DEATHS} times (killed, or out of memory)"
    assert found == {n: n for n in (0, 1, 3, 4)}


@pytest.mark.exhaustive
def test_without_a_result_for_it_a_deadly_task_is_an_error(tmp_path):
    with pytest.raises(PoolError, match="task 1 cannot be done") as error:
        list(run_in_processes(dies, [(2, str(tmp_path))], 1))
    assert "\n" not in str(error.value)


@pytest.mark.slow
def test_a_worn_process_is_replaced():
    pids = [pid for batch in run_in_processes(identity, range(3), 1) for _, pid in batch]
    assert len(set(pids)) == 1
    wears = run_in_processes(identity, range(4), 1, worn=lambda _: True)
    assert len({pid for batch in wears for _, pid in batch}) == 2, "two tasks at a time"


@pytest.mark.slow
def test_waiting_is_told_of():
    batches = run_in_processes(time.sleep, [0.5], 1, every=0.05)
    assert [bool(batch) for batch in batches][-4:] == [False, False, False, True]


def die() -> None:
    """Stands for what a process does first."""
    os._exit(1)


@pytest.mark.slow
def test_processes_that_cannot_start_cost_no_task(monkeypatch):
    monkeypatch.setattr(pool, "_end_with_parent", die)
    with pytest.raises(PoolError, match=r"die as they start"):
        list(run_in_processes(square, [1], 1))


@pytest.mark.parametrize("workers", [0, -1, 1.5, True, 1000, "2"])
def test_bad_workers_are_refused(workers):
    with pytest.raises(InputError, match="workers"):
        check_workers(workers)


SCRIPT = """
import sys, time
from pathlib import Path
from drake_racket.pool import PoolError, run_in_processes
from tests.test_pool import square

def work():
    with Path(sys.argv[1]).open("a") as file:
        file.write("started ")
    try:
        print(sum(r for batch in run_in_processes(square, range(5), 2) for _, r in batch))
    except PoolError as error:
        print(error)

"""
UNGUARDED = SCRIPT + "work()\n"
GUARDED = SCRIPT + "if __name__ == '__main__':\n    work()\n"


def run_script(how: str, script: str, tmp_path: Path) -> subprocess.CompletedProcess[str]:
    file = tmp_path / "script.py"
    file.write_text(script)
    command = [sys.executable, *{"file": [str(file)], "-c": ["-c", script], "stdin": ["-"]}[how]]
    return subprocess.run(
        [*command, str(tmp_path / "mark")],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        cwd=tmp_path,
        input=script if how == "stdin" else None,
        capture_output=True,
        text=True,
        timeout=SECONDS,
        check=False,
    )


@pytest.mark.slow
@pytest.mark.parametrize("how", ["file", "-c", "stdin"])
def test_scripts_from_anywhere_may_start_processes(how, tmp_path):
    done = run_script(how, GUARDED, tmp_path)
    assert (done.stdout, done.stderr) == ("30\n", "")


CELL = """
import drake_racket as dr
from drake_racket.sweep import make_sweep, run_sweep
base = dr.Scenario(after=0.002, audit=False)
sweep = make_sweep(base, {"point": [2, 5]}, ["kb"])
print(run_sweep(sweep, "out", workers=2)["status"].values.tolist())
"""


@pytest.mark.slow
def test_a_notebook_may_start_processes(tmp_path, monkeypatch):
    nbclient = pytest.importorskip("nbclient", reason="needs the extra docs")
    nbformat = pytest.importorskip("nbformat", reason="needs the extra docs")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(CELL)])
    there = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(notebook, timeout=int(SECONDS), resources=there).execute()
    said = "".join(out.text for out in notebook.cells[0].outputs if out.get("name") == "stdout")
    assert said == "[0, 0]\n"


def test_a_script_without_main_guard_ends_with_one_line(tmp_path):
    done = run_script("file", UNGUARDED, tmp_path)
    assert done.stderr == ""
    (line,) = done.stdout.splitlines()
    assert "if __name__ == '__main__':" in line


SLEEPER = """
import sys, time
from pathlib import Path
from drake_racket.pool import run_in_processes
from tests.test_pool import tell_and_sleep

if __name__ == "__main__":
    for _ in run_in_processes(tell_and_sleep, [sys.argv[1]] * 2, 2):
        pass
"""


def tell_and_sleep(directory: str) -> None:
    (Path(directory) / str(os.getpid())).touch()
    time.sleep(300.0)


@pytest.mark.parametrize(
    "number",
    [
        pytest.param(signal.SIGINT, marks=pytest.mark.slow),
        signal.SIGTERM,
        pytest.param(signal.SIGKILL, marks=pytest.mark.slow),
    ],
)
def test_processes_end_with_their_parent(number, tmp_path):
    script, marks = tmp_path / "script.py", tmp_path / "marks"
    script.write_text(SLEEPER)
    marks.mkdir()
    parent = subprocess.Popen(
        [sys.executable, script, marks],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stderr=subprocess.DEVNULL,
    )
    wait_for(lambda: len(list(marks.iterdir())) == 2)
    workers = [int(path.name) for path in marks.iterdir()]
    parent.send_signal(number)
    parent.wait(SECONDS)
    wait_for(lambda: not any(Path(f"/proc/{pid}").exists() for pid in workers))
    assert parent.returncode == -number


def wait_for(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + SECONDS
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)
