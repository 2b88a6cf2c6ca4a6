"""Says where a new racket's file goes, and writes it; tensions and balls as options give them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drake_racket.io.errors import InputError
from drake_racket.io.files import check_directory, directory_error
from drake_racket.io.units import measure

if TYPE_CHECKING:
    from drake_racket.parameters.racket import RacketParameters

_SUFFIXES = (".yaml", ".yml")


def is_file(out: Path) -> bool:
    """Tells whether `--out` names a file, and not a directory."""
    return out.suffix in _SUFFIXES


def check_paths(paths: Sequence[Path], by: str) -> None:
    """Refuses paths that cannot be written, and files that `by` has not written itself."""
    for path in paths:
        check_directory(path.parent, "--out")
        if path.exists() and not _written_by(path, by):
            command = by.removeprefix("drake-racket ")
            raise InputError(
                "--out", str(path), f"a file that is not there yet, or one that {command} wrote"
            )


def write_rackets(rackets: Sequence[RacketParameters], paths: Sequence[Path], by: str) -> None:
    """Writes the files, whose directories are made."""
    from drake_racket.parameters.written import write_racket

    for racket, path in zip(rackets, paths, strict=True):
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_racket(racket, path, by)
        except OSError as error:
            raise directory_error(path.parent, error, "--out") from None


def _written_by(path: Path, by: str) -> bool:
    try:
        with path.open(encoding="utf-8") as file:
            return file.readline().startswith(f"# Written by {by}.")
    except (OSError, UnicodeDecodeError):
        return False


def stringing(tension: str) -> str:
    """Gives a tension as scenarios take it: `low`, `high`, or a number in N; `55lb` is one."""
    if tension in ("low", "high"):
        return tension
    return f"{measure('--tension', tension, 'N', bare=''):.10g}"
