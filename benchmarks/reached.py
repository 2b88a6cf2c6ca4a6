"""Notes which lines of the package each test passes: a pytest plugin for Python 3.12 or later.

    PYTHONPATH=. python -m pytest -p benchmarks.reached --reached reach.jsonl [tests ...]
    NUMBA_DISABLE_JIT=1 PYTHONPATH=. python -m pytest -p benchmarks.reached --reached plain.jsonl \
        --limit 20 tests/laws tests/engines

One line of JSON a test that is good: its name, its seconds, and the lines by module that it passed
when it was called, and while it was set up (what a fixture of a whole file does is done in its
first test). What runs as machine code or in another process is not seen: the second command shows
the former, and leaves out tests that are longer than `--limit` (s) in plain Python.
"""

from __future__ import annotations

import json
import signal
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from types import CodeType

import pytest

PACKAGE = str(Path(__file__).resolve().parents[1] / "drake_racket") + "/"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--reached", type=Path, help="file that the lines are appended to")
    parser.addoption("--limit", type=float, default=0.0, help="seconds of a test; 0: no limit")


class Reached:
    """Collects the lines of a test's phases and appends them to a file."""

    def __init__(self, file: Path, limit: float) -> None:
        self.file, self.limit, self.good = file, limit, True
        self.lines: dict[str, set[int]] = defaultdict(set)
        self.phases: dict[str, dict[str, list[int]]] = {}
        monitoring = sys.monitoring
        monitoring.use_tool_id(monitoring.COVERAGE_ID, "reached")
        monitoring.register_callback(monitoring.COVERAGE_ID, monitoring.events.LINE, self.line)
        monitoring.set_events(monitoring.COVERAGE_ID, monitoring.events.LINE)

    def line(self, code: CodeType, line: int) -> object:
        """Notes a line once; until the next phase it costs nothing more."""
        if code.co_filename.startswith(PACKAGE):
            self.lines[code.co_filename[len(PACKAGE) :]].add(line)
        return sys.monitoring.DISABLE

    def phase(self, name: str) -> Iterator[None]:
        """Collects the lines of one phase of a test."""
        self.lines.clear()
        sys.monitoring.restart_events()
        yield
        self.phases[name] = {module: sorted(lines) for module, lines in self.lines.items()}

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_setup(self) -> Iterator[None]:
        """Collects what the test's fixtures pass."""
        self.began, self.good = time.process_time(), True
        signal.setitimer(signal.ITIMER_REAL, self.limit)
        yield from self.phase("setup")

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_call(self) -> Iterator[None]:
        """Collects what the test itself passes."""
        yield from self.phase("call")

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Notes a test that fails or is left out."""
        self.good = self.good and report.passed

    def pytest_runtest_logfinish(self, nodeid: str) -> None:
        """Writes one test's line."""
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        seconds = round(time.process_time() - self.began, 3) if self.phases else 0.0
        entry = {"test": nodeid, "seconds": seconds, **self.phases}
        self.phases = {}
        if not self.good:
            return
        with self.file.open("a", encoding="utf-8") as file:
            file.write(json.dumps(entry) + "\n")


def pytest_configure(config: pytest.Config) -> None:
    file = config.getoption("--reached")
    if file is not None:
        signal.signal(signal.SIGALRM, _too_long)
        config.pluginmanager.register(Reached(file, config.getoption("--limit")))


def pytest_unconfigure() -> None:
    if sys.monitoring.get_tool(sys.monitoring.COVERAGE_ID) == "reached":
        sys.monitoring.set_events(sys.monitoring.COVERAGE_ID, sys.monitoring.events.NO_EVENTS)


def _too_long(number: int, frame: object) -> None:
    raise TimeoutError("longer than --limit")
