"""`drake-racket examples` copies the shipped files, to be changed, and the studies, to be run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drake_racket.cli.console import working
from drake_racket.io.errors import InputError
from drake_racket.io.files import check_directory, directory_error, write_text
from drake_racket.io.shipped import data_directory, studies_directory

_NOT_COPIED = ("published.yaml", "references.yaml")  # of the validation, and of `cite`


def examples(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Where the files go.")],
) -> None:
    """Copies the shipped rackets, balls, grips, limb, scenarios, sweep and studies to DIR."""
    check_directory(directory, "DIR")
    sources = _sources(directory)
    for target in sources:
        if target.exists():
            name = target.relative_to(directory)
            raise InputError("DIR", str(directory), f"a directory without a {name} of yours")
    try:
        with working("copying"):
            for target, source in sources.items():
                target.parent.mkdir(parents=True, exist_ok=True)
                write_text(source.read_text(encoding="utf-8"), target)
    except OSError as error:
        raise directory_error(directory, error, "DIR") from None
    for target in sources:
        if target.parent == directory:
            print(f"wrote {target}")
    print(f"wrote {directory / 'studies'} ({len(list(directory.glob('studies/**/*.py')))} files)")
    print(f"try: drake-racket impact {directory / 'backhand.yaml'}")
    print(f"     drake-racket sweep {directory / 'speeds.yaml'} --out speeds")
    print(f"     cd {directory} && python -m studies.sweet_spots --quick")


def _sources(directory: Path) -> dict[Path, Path]:
    """Where each file goes -> where it is."""
    found = {
        directory / path.name: path
        for path in sorted(data_directory().glob("*.yaml"))
        if path.name not in _NOT_COPIED
    }
    studies = studies_directory()
    for path in sorted(studies.rglob("*")):
        tests = path.name.startswith("test_") or path.name == "conftest.py"
        if path.suffix in (".py", ".csv", ".yaml") and not tests:
            found[directory / "studies" / path.relative_to(studies)] = path
    return found
