"""The commands share what is here: the console, how far they are, and how they are ended."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import typer
from rich.console import Console

from drake_racket.io.interrupts import exit_status, interrupt_word
from drake_racket.io.progress import Progress, Report

LINE_EVERY = 5.0
"""Seconds between lines of progress where there is no terminal."""

_BRIEF = ("checking", "fitting", "frames")  # tasks without a line at their begin and end

Describe = Callable[[Progress], str]


def new_console() -> Console:
    """Makes a console: a terminal's own width; wide lines where the output is a file or a pipe."""
    return Console(highlight=False, width=None if sys.stdout.isatty() else 160)


@contextmanager
def ending_on_signals(text: str) -> Iterator[None]:
    """Ctrl-C and SIGTERM end the command with one line and the shell's status, 130 or 143.

    Args:
        text: how to go on.

    """
    try:
        yield
    except KeyboardInterrupt as interrupt:
        print(f"drake-racket: {interrupt_word(interrupt)}; {text}", file=sys.stderr)
        raise typer.Exit(exit_status(interrupt)) from None


@contextmanager
def working(text: str) -> Iterator[None]:
    """Shows on a terminal's standard error that something is being done."""
    if not sys.stderr.isatty():
        yield
        return
    with Console(stderr=True).status(f"{text} ..."):
        yield


@contextmanager
def showing(describe: Describe, *, quiet: bool = False, lines: bool = True) -> Iterator[Report]:
    """Shows on standard error how far a command is: a bar a task on a terminal, lines elsewhere.

    Args:
        describe: what to say beside the task's name.
        quiet: show nothing.
        lines: where there is no terminal; without them what takes seconds is quiet there.

    """
    if quiet or not (lines or sys.stderr.isatty()):
        yield lambda _: None
    elif sys.stderr.isatty():
        with _bars(describe) as report:
            yield report
    else:
        yield _Lines(describe)


@contextmanager
def _bars(describe: Describe) -> Iterator[Report]:
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[text]}"),
        TimeElapsedColumn(),
    )
    with Bars(*columns, console=Console(stderr=True)) as bars:
        tasks: dict[str, Any] = {}

        def report(now: Progress) -> None:
            if now.task not in tasks:
                tasks[now.task] = bars.add_task(now.task, text="")
            text = describe(now)
            bars.update(tasks[now.task], completed=now.done, total=now.total, text=text)

        yield report


class _Lines:
    """Prints a line every few seconds, and at the begin and the end of a task."""

    def __init__(self, describe: Describe) -> None:
        self._describe = describe
        self._last = time.monotonic()
        self._task = ""

    def __call__(self, progress: Progress) -> None:
        now = time.monotonic()
        turn = progress.task != self._task or progress.done == progress.total
        due = turn and progress.task not in _BRIEF
        self._task = progress.task
        if due or now - self._last >= LINE_EVERY:
            self._last = now
            text = f"{progress.task}: {self._describe(progress)}"
            print(f"drake-racket: {text}", file=sys.stderr, flush=True)
