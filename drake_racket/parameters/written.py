"""Writes parameter files: what their own reader takes, and what it leaves out by itself."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import yaml

from drake_racket.io.files import replace_file
from drake_racket.parameters.ball import BallParameters, read_ball
from drake_racket.parameters.racket import RacketParameters, read_racket

_STATUSES = "status: printed, calculated, measured, fitted or inferred."


def write_racket(racket: RacketParameters, path: str | Path, by: str = "drake_racket") -> None:
    """Writes a racket's file, which is read back before it takes its name.

    Args:
        by: what made the numbers, for the file's first line.

    Raises:
        InputError: a racket that its own reader refuses.

    """
    path = Path(path)
    _write(racket, path, read_racket, by)


def write_ball(ball: BallParameters, path: str | Path, by: str = "drake_racket") -> None:
    """Writes a ball's file as `write_racket` does a racket's."""
    path = Path(path)
    _write(ball, path, read_ball, by)


def _write(parameters: Any, path: Path, read: Callable[[Path], object], by: str) -> None:
    text = f"# Written by {by}. {_STATUSES}\n" + parameters_text(parameters)

    def write(temporary: Path) -> None:
        temporary.write_text(text, encoding="utf-8")
        read(temporary)

    replace_file(path, write)


def parameters_text(parameters: Any) -> str:
    """Gives a parameter dataclass as YAML, numbers to the last bit; what is empty is left out."""
    tree = _without_empty(dataclasses.asdict(parameters))
    # one line a number, as in the shipped files
    return str(
        yaml.safe_dump(
            tree, sort_keys=False, allow_unicode=True, width=2000, default_flow_style=None
        )
    )


def _without_empty(tree: dict[str, Any]) -> dict[str, Any]:
    found = {}
    for key, value in tree.items():
        if value is None or (key in ("specs", "added") and not value):
            continue
        found[key] = _without_empty(value) if type(value) is dict else value
    return found
