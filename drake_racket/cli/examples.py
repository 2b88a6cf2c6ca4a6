"""`drake-racket examples` copies the shipped files, to be changed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drake_racket.io.errors import InputError
from drake_racket.io.files import check_directory, directory_error, write_text
from drake_racket.io.shipped import data_directory

_NOT_COPIED = ("published.yaml",)  # what the validation compares with


def examples(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Where the files go.")],
) -> None:
    """Copies the shipped rackets, balls, grips, limb, scenarios and a sweep to DIR."""
    check_directory(directory, "DIR")
    sources = [p for p in sorted(data_directory().glob("*.yaml")) if p.name not in _NOT_COPIED]
    for source in sources:
        if (directory / source.name).exists():
            raise InputError("DIR", str(directory), f"a directory without a {source.name} of yours")
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for source in sources:
            write_text(source.read_text(encoding="utf-8"), directory / source.name)
    except OSError as error:
        raise directory_error(directory, error, "DIR") from None
    for source in sources:
        print(f"wrote {directory / source.name}")
    print(f"try: drake-racket impact {directory / 'backhand.yaml'}")
    print(f"     drake-racket sweep {directory / 'speeds.yaml'} --out speeds")
