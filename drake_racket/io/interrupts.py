"""Ctrl-C and SIGTERM end a long command alike: what is finished is kept, in one line."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class Terminated(KeyboardInterrupt):
    """SIGTERM has come (see `terminable`)."""


def exit_status(interrupt: BaseException) -> int:
    """Tells what a shell expects of a command that a signal has ended: 128 and its number."""
    return 128 + (signal.SIGTERM if isinstance(interrupt, Terminated) else signal.SIGINT)


def interrupt_word(interrupt: BaseException) -> str:
    """Tells what has happened to the command."""
    return "terminated" if isinstance(interrupt, Terminated) else "interrupted"


_COME: list[KeyboardInterrupt] = []  # signals are the process's: so is the record of them


@contextmanager
def terminable() -> Iterator[list[KeyboardInterrupt]]:
    """Lets SIGTERM raise Terminated within it, as Ctrl-C raises KeyboardInterrupt.

    Yields:
        The interrupts that have come: some libraries turn them into exceptions of their own, and
        one that comes while Python tidies up is lost (see `raise_interrupts`).

    """
    come: list[KeyboardInterrupt] = []
    if threading.current_thread() is not threading.main_thread():
        yield come
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        come.append(Terminated() if number == signal.SIGTERM else KeyboardInterrupt())
        _COME.append(come[-1])
        raise come[-1]

    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, interrupt) for number in numbers]
    try:
        yield come
    finally:
        _COME.clear()
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


@contextmanager
def noticed() -> Iterator[None]:
    """Keeps a Ctrl-C that comes within it in mind, where Python's own handler would be called.

    For a library function that its caller runs without `terminable`.
    """
    ours = threading.current_thread() is threading.main_thread()
    if not ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        _COME.append(KeyboardInterrupt())
        raise _COME[-1]

    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        _COME.clear()
        signal.signal(signal.SIGINT, signal.default_int_handler)


def interrupted() -> bool:
    """Tells whether a signal has come within `terminable` or `noticed`."""
    return bool(_COME)


def raise_interrupts() -> None:
    """Raises a signal that has come (see `interrupted`): long work calls it between its parts.

    Python drops an exception that a signal's handler raises inside a destructor or a callback that
    cannot fail; the work would go on.
    """
    if _COME:
        raise _COME[-1]


@contextmanager
def undisturbed() -> Iterator[None]:
    """Lets no further Ctrl-C or SIGTERM count within it, to leave things in order after the first.

    They often come twice, from the terminal or a scheduler and from the process above.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, signal.SIG_IGN) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
