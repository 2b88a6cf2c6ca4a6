"""Writes the rows as Markdown, HTML, CSV and JSON."""

from __future__ import annotations

import csv
import html
import io
import platform
from collections import Counter
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from drake_racket.io.files import write_text
from drake_racket.io.numbers import json_data, json_text
from drake_racket.parameters.ball import load_ball
from drake_racket.parameters.grip import load_grip
from drake_racket.parameters.quantities import sourced_fields
from drake_racket.parameters.racket import load_racket
from drake_racket.validation.outcome import Plan
from drake_racket.validation.published import PublishedValue
from drake_racket.validation.rows import AGREES, DIFFERS, NOT_COMPARABLE, Comparison


def write_report(
    out: str | Path,
    rows: Sequence[Comparison],
    sections: dict[str, dict[str, Any]],
    titles: dict[str, str],
    plan: Plan,
) -> None:
    """Writes report.md, report.html, rows.csv and rows.json into `out`.

    Args:
        sections: name -> what `run` keeps of it (text, figures).  titles: name -> heading.

    """
    out = Path(out)
    records = [_record(row) for row in rows]
    table = io.StringIO()
    writer = csv.DictWriter(table, list(records[0]), lineterminator="\n")
    writer.writeheader()
    for record in records:
        depends = " ".join(record["depends_on_inferred"])
        writer.writerow(record | {"depends_on_inferred": depends})
    write_text(table.getvalue(), out / "rows.csv")
    write_text(json_text(records), out / "rows.json")
    text = markdown(rows, sections, titles, plan)
    write_text(text, out / "report.md")
    write_text(as_html(text), out / "report.html")


def _record(row: Comparison) -> dict[str, Any]:
    entry = row.published
    return {
        "key": entry.key,
        "section": entry.section,
        "quantity": entry.quantity,
        "unit": entry.unit,
        "published": entry.value,
        "published_low": entry.low,
        "published_high": entry.high,
        "source": entry.source,
        "model": json_data(row.model),
        "difference": json_data(row.difference),
        "tolerance": row.tolerance,
        "tolerance_reason": entry.tolerance_reason,
        "verdict": row.verdict,
        "reason": row.reason(),
        "depends_on_inferred": entry.depends_on,
        "own": entry.own,
    }


def markdown(
    rows: Sequence[Comparison],
    sections: dict[str, dict[str, Any]],
    titles: dict[str, str],
    plan: Plan,
) -> str:
    """Gives the report as Markdown."""
    counts = Counter(row.verdict for row in rows)
    lines = [
        "# Validation report",
        "",
        "Written by `drake-racket validate`: every published number that the model can be held"
        " against, what the model gives, and how far off it is. Verdicts follow from the numbers:"
        " the difference against the stated tolerance. The source is Glynn, King & Mitchell (2011),"
        " doi:10.1007/s12283-010-0056-x, where no other is named.",
        "",
        f"{len(rows)} rows: **{counts[AGREES]} agree, {counts[DIFFERS]} differ,"
        f" {counts[NOT_COMPARABLE]} are not comparable.**",
        "",
        _apart(rows),
        "",
        f"drake_racket {version('drake-racket')}, Drake {version('drake')},"
        f" Python {platform.python_version()}."
        f" {len(plan.points)} points, {len(plan.speeds)} speeds."
        + ("" if plan.settings() == Plan().settings() else " **A coarse grid, for a first look.**"),
        "",
        "What differs:",
        "",
        *[_one_line(row) for row in rows if row.verdict == DIFFERS],
    ]
    for name, record in sections.items():
        lines += ["", f"## {titles[name]}", ""]
        for paragraph in record["text"]:
            lines += [paragraph, ""]
        lines += _table([row for row in rows if row.published.section == name])
        for figure in record["figures"]:
            lines += ["", f"![{figure['caption']}](figures/{figure['file']})", ""]
            lines += [f"*{figure['caption']}*"]
    lines += ["", "## What is inferred", "", *_inferred(rows), ""]
    return "\n".join(lines)


def _apart(rows: Sequence[Comparison]) -> str:
    """Counts rows that could have failed apart from those that hardly could."""
    counted = [row for row in rows if row.verdict != NOT_COMPARABLE]
    own = [row for row in counted if row.published.own]
    others = [row for row in counted if not row.published.own]
    agree = sum(row.verdict == AGREES for row in others)
    return (
        f"{len(own)} of them compare the model with its own input, fit or closed form, and could"
        f" hardly fail. Of the {len(others)} that could, **{agree} agree.**"
    )


def _one_line(row: Comparison) -> str:
    entry = row.published
    return (
        f"- {entry.quantity}: published {_published(entry)}, model"
        f" {_with_unit(row.model, entry.unit)} ({row.reason()})"
    )


def _table(rows: Sequence[Comparison]) -> list[str]:
    lines = [
        "| quantity | published | source | model | difference | tolerance | verdict | why |"
        " depends on inferred |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        entry = row.published
        cells = (
            entry.quantity,
            _published(entry),
            entry.source,
            _with_unit(row.model, entry.unit),
            _difference(row),
            _tolerance(row),
            f"**{row.verdict}**" if row.verdict == DIFFERS else row.verdict,
            row.reason(),
            ", ".join(f"`{key}`" for key in entry.depends_on) or "nothing",
        )
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return lines


_NONE = "-"
_SHOWN_UNITS = {"1": "", "deg": "°", "m/s^2": " m/s²"}


def _with_unit(value: float | None, unit: str) -> str:
    if value is None:
        return _NONE
    return f"{value:.4g}" + _SHOWN_UNITS.get(unit, f" {unit}")


def _published(entry: PublishedValue) -> str:
    unit = _SHOWN_UNITS.get(entry.unit, f" {entry.unit}")
    if entry.value is not None:
        return f"{entry.value:.4g}{unit}"
    if entry.low is not None and entry.high is not None:
        return f"{entry.low:.4g} to {entry.high:.4g}{unit}"
    if entry.low is not None:
        return f"at least {entry.low:.4g}{unit}"
    if entry.high is not None:
        return f"at most {entry.high:.4g}{unit}"
    return _NONE


def _difference(row: Comparison) -> str:
    entry = row.published
    if row.difference is None:
        return _NONE
    if row.difference == 0.0:
        return "0"
    size = entry.value or entry.low or entry.high
    share = f" ({100 * row.difference / abs(size):+.1f} %)" if size else ""
    return f"{row.difference:+.3g}{_SHOWN_UNITS.get(entry.unit, ' ' + entry.unit)}{share}"


def _tolerance(row: Comparison) -> str:
    entry = row.published
    if row.tolerance is None:
        return _NONE
    relative = entry.tolerance_kind == "relative"
    amount = f"{100 * entry.tolerance:g} %" if relative else _with_unit(row.tolerance, entry.unit)
    return f"{amount}: {entry.tolerance_reason}"


def _inferred(rows: Sequence[Comparison]) -> list[str]:
    """The inferred values that some row depends on, with what they are and why."""
    used = {key for row in rows for key in row.published.depends_on}
    known = inferred_values()
    lines = ["| key | what the files say |", "|---|---|"]
    lines += [f"| `{key}` | {known[key]} |" for key in sorted(used)]
    return lines


def inferred_values() -> dict[str, str]:
    """Gives the key -> source text of every inferred value of the shipped racket, ball and grip."""
    values = {
        key: value.source
        for key, value in (
            *sourced_fields(load_racket()),
            *sourced_fields(load_ball(), "ball"),
            *sourced_fields(load_grip(), "grip"),
        )
        if value.status == "inferred"
    }
    return values


_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 78rem; margin: 2rem auto; padding: 0 1rem;
  color: #1a1a1a; background: #fff }
table { border-collapse: collapse; font-size: 0.85rem; margin: 1rem 0 }
th, td { border: 1px solid #ccc; padding: 0.25rem 0.5rem; text-align: left; vertical-align: top }
th { background: #f2f2f2 }
img { max-width: 100% }
code { font-size: 0.9em }
"""


def as_html(text: str) -> str:
    """Gives the Markdown as one HTML page; its figures stay files beside it."""
    from markdown_it import MarkdownIt

    body = MarkdownIt("commonmark", {"html": False}).enable("table").render(text)
    title = html.escape(text.splitlines()[0].removeprefix("# "))
    return (
        f'<!doctype html>\n<html lang="en">\n<head><meta charset="utf-8"><title>{title}</title>\n'
        f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style></head>\n'
        f"<body>\n{body}</body>\n</html>\n"
    )
