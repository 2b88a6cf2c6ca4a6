"""One exception is raised by bad input, one by work that cannot go on; scripts print one line."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from pathlib import PurePath
from typing import Any

from drake_racket.io.interrupts import exit_status, interrupt_word, terminable


class InputError(ValueError):
    """The error says which value from outside cannot be used, and what is allowed.

    The message is one line: the key (or file), the value as given, and what is allowed.
    The command line prints it and exits with status 2.
    """

    def __init__(self, key: str, value: object, allowed: str) -> None:
        self.key = key
        self.value = value
        self.allowed = allowed
        super().__init__(f"{one_line(key)}: got {_shown(value)}; allowed: {one_line(allowed)}")

    def __reduce__(self) -> Any:
        """It travels between processes."""
        return type(self), (self.key, self.value, self.allowed)


class SimulationError(RuntimeError):
    """The error says where a run that could not be finished stopped, and why."""


class WorkStopped(RuntimeError):
    """The error says why work cannot go on, for a reason not in its input; it is one line."""


def _shown(value: object, limit: int = 80) -> str:
    """`value` as Python shows it, on one line; a path whole, since its end tells most."""
    if isinstance(value, PurePath):
        return one_line(repr(str(value)))
    try:
        text = repr(value)
    except ValueError:  # an int beyond sys.get_int_max_str_digits()
        text = f"an integer of {value.bit_length()} bits" if isinstance(value, int) else "a value"
    return one_line(text, limit)


def one_line(text: str, limit: int = 500) -> str:
    """Gives `text` without line breaks or control characters, shortened to `limit` characters."""
    text = "".join(c if c.isprintable() else " " for c in text)
    return text if len(text) <= limit else text[: limit - 3] + "..."


@contextlib.contextmanager
def one_line_errors(program: str, *, kept: str = "") -> Iterator[None]:
    """Turns what ends a script's main block early into one line and an exit status.

    2 for an InputError, 1 for a WorkStopped, 130 for Ctrl-C and 143 for SIGTERM.

    Args:
        program: as it is called.
        kept: what an interrupted run leaves, and how to go on.

    """
    try:
        with terminable():
            yield
    except InputError as error:
        print(f"{program}: {one_line(str(error))}", file=sys.stderr)
        sys.exit(2)
    except WorkStopped as error:
        print(f"{program}: {one_line(str(error))}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt as interrupt:
        text = interrupt_word(interrupt) + (f"; {kept}" if kept else "")
        print(f"{program}: {text}", file=sys.stderr)
        sys.exit(exit_status(interrupt))
