"""The console that the commands print to."""

from __future__ import annotations

import sys

from rich.console import Console


def new_console() -> Console:
    """A terminal's own width; wide lines where the output is a file or a pipe."""
    return Console(highlight=False, width=None if sys.stdout.isatty() else 160)
