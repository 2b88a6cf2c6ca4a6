"""What the tests of quoted numbers share: pages, and the files of docs/results and of the report.

`python -m manual.refresh NAME` writes the files. A test that fails shows the sentence that the page
should have.
"""

from __future__ import annotations

import csv
import functools
import json
import re

from manual.refresh import RESULTS
from tests.conftest import ROOT


@functools.cache
def page_text(name: str) -> str:
    """A page on one line, without emphasis."""
    text = (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
    return " ".join(text.replace("**", "").split())


def says(page: str, *sentences: str) -> None:
    """Checks that the page has these sentences, or lines of tables."""
    missing = [s for s in sentences if " ".join(s.split()) not in page_text(page)]
    assert not missing, "\n".join([f"docs/{page}.md should say:", *missing])


@functools.cache
def printed(name: str) -> str:
    """What a command printed."""
    return (RESULTS / f"{name}.txt").read_text(encoding="utf-8")


def found(name: str, pattern: str) -> tuple[float, ...]:
    """The numbers of the groups of a pattern in what a command printed."""
    match = re.search(pattern, printed(name))
    assert match is not None, f"docs/results/{name}.txt: {pattern}"
    return tuple(map(float, match.groups()))


@functools.cache
def rows(table: str) -> list[dict[str, str]]:
    """The rows of a table (CSV), by the names of its columns without units."""
    with (RESULTS / f"{table}.csv").open(encoding="utf-8", newline="") as file:
        return [
            {column.split(" [")[0]: cell for column, cell in row.items()}
            for row in csv.DictReader(file)
        ]


def cells(name: str, first: str) -> list[str]:
    """The cells after the first of a row of a Markdown table that a command printed."""
    (line,) = re.findall(rf"^\| {re.escape(first)} +\|(.*)\|$", printed(name), re.MULTILINE)
    return [cell.strip() for cell in line.split("|")]


def short(value: float, digits: int = 3) -> str:
    """As the pages write shares: .409."""
    return f"{value:.{digits}f}".replace("0.", ".", 1)


REPORT = {
    row["key"]: row
    for row in json.loads((ROOT / "docs/validation/rows.json").read_text(encoding="utf-8"))
}


def model(key: str) -> float:
    return float(REPORT[key]["model"])
