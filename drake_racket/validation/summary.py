"""Writes what stands before the sections of the report: a summary of a minute, the contents."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence

from drake_racket.validation.rows import AGREES, DIFFERS, NOT_COMPARABLE, Comparison

KINDS = {
    "": "a measurement: the model never saw the number, and the row could have failed",
    "fit": "a number that had a say in a fitted or inferred value of the model",
    "input": "the model's own input, or the source's tables against its own words",
    "closed form": "a closed form, or another calculation with the same model",
}
"""What a row is held against (PublishedValue.own) -> what its agreement is worth."""


def count_table(rows: Sequence[Comparison]) -> list[str]:
    """Counts the verdicts for each kind of row, as lines of a Markdown table."""
    lines = [
        "| what the row is held against | rows | agree | differ | not comparable |",
        "|---|---:|---:|---:|---:|",
    ]
    for kind, meaning in KINDS.items():
        chosen = [row for row in rows if row.published.own == kind]
        if chosen:
            cells = " | ".join(str(n) for n in _counts(chosen))
            lines.append(f"| {meaning} | {cells} |")
    return lines


def _counts(rows: Sequence[Comparison]) -> tuple[int, int, int, int]:
    """Gives how many rows there are, agree, differ, and cannot be compared."""
    found = Counter(row.verdict for row in rows)
    return len(rows), found[AGREES], found[DIFFERS], found[NOT_COMPARABLE]


def contents(rows: Sequence[Comparison], titles: dict[str, str]) -> list[str]:
    """Lists the sections with links, and how their rows that could have failed came out."""
    lines = [
        "| section | could have failed: agree | differ | other rows: agree | differ |",
        "|---|---:|---:|---:|---:|",
    ]
    for name, title in titles.items():
        here = [row for row in rows if row.published.section == name]
        _, agree, differ, _ = _counts([r for r in here if not r.published.own])
        _, other, wrong, _ = _counts([r for r in here if r.published.own])
        lines.append(f"| [{title}](#{slug(title)}) | {agree} | {differ} | {other} | {wrong} |")
    others = ("What differs", "Commands", "What is inferred")
    lines += ["", "And: " + ", ".join(f"[{title}](#{slug(title)})" for title in others) + "."]
    return lines


def slug(heading: str) -> str:
    """Gives the anchor of a heading as GitHub and MkDocs make it.

    >>> slug("Free, held and clamped racket")
    'free-held-and-clamped-racket'
    """
    return re.sub(r"[\s]+", "-", re.sub(r"[^\w\s-]", "", heading).strip().lower())


def command_anchor(section: str) -> str:
    """Gives the anchor of the command that computes a section."""
    return slug(f"Command {section}")


STUDIES = {
    "force_plate": "python studies/force_plate.py --out DIR",
    "frame_modes": "python studies/frame_modes.py --out DIR",
    "impact_hammer": "python studies/impact_hammer.py --out DIR",
    "inertia_bench": "python studies/inertia_bench.py --out DIR",
    "head_clamped": "python studies/head_clamped.py --out DIR",
    "oblique": "python studies/head_clamped.py --out DIR",
    "moving_racket": "python studies/moving_racket.py --out DIR",
    "static_stiffness": "python studies/static_stiffness.py --out DIR",
}
"""Section -> the study that runs the same experiment by itself, with its data and figures."""


def commands(sections: Iterable[str]) -> list[str]:
    """Gives a heading and the commands of each section."""
    lines = ["Every row is made by the command of its section; `--out` is where the report goes."]
    for name in sections:
        lines += ["", f"### Command {name}", "", "```console"]
        lines.append(f"drake-racket validate --out report --only {name}")
        if name in STUDIES:
            lines.append(f"{STUDIES[name]}   # the experiment by itself, with its data")
        lines.append("```")
    return lines
