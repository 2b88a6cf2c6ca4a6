"""Writes the rows as Markdown, HTML, CSV and JSON."""

from __future__ import annotations

import csv
import html
import io
import platform
from collections.abc import Sequence
from importlib.metadata import version
from itertools import pairwise
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
from drake_racket.validation.rows import AGREES, DIFFERS, Comparison, published_size
from drake_racket.validation.summary import (
    command_anchor,
    commands,
    contents,
    count_table,
    slug,
)


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
        "command": f"drake-racket validate --out report --only {entry.section}",
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
    able = [row for row in rows if not row.published.own]
    agree, differ = (sum(row.verdict == v for row in able) for v in (AGREES, DIFFERS))
    lines = [
        "# Validation report",
        "",
        "## In one minute",
        "",
        f"This report holds the model against {len(rows)} published numbers. Of those that could"
        f" have failed **{agree} agree and {differ} differ**. The other rows are checks of the"
        " program rather than of the model: their numbers are inputs, were in view when a missing"
        " value was inferred, or come from the same equations.",
        "",
        *count_table(rows),
        "",
        "A verdict follows from the numbers alone: a row agrees if the difference is within the"
        " tolerance that the row states. Where no other source is named, the number is from Glynn,"
        " King & Mitchell (2011), doi:10.1007/s12283-010-0056-x.",
        "",
        f"Computed by `drake-racket validate` with drake_racket {version('drake-racket')}, Drake"
        f" {version('drake')}, Python {platform.python_version()}, at {len(plan.points)} points and"
        f" {len(plan.speeds)} speeds."
        + ("" if plan.settings() == Plan().settings() else " **A coarse grid, for a first look.**"),
        "",
        "## Contents",
        "",
        *contents(rows, titles),
    ]
    for name, record in sections.items():
        lines += ["", f"## {titles[name]}", ""]
        for paragraph in record["text"]:
            lines += [paragraph, ""]
        lines += _table([row for row in rows if row.published.section == name])
        for figure in record["figures"]:
            lines += ["", f"![{figure['caption']}](figures/{figure['file']})", ""]
            lines += [f"*{figure['caption']}*"]
    lines += ["", "## What differs", "", *_differences(rows)]
    lines += ["", "## Commands", "", *commands(sections)]
    lines += ["", "## What is inferred", "", *_inferred(rows), ""]
    return "\n".join(lines)


def _differences(rows: Sequence[Comparison]) -> list[str]:
    """Lists the rows that differ: first those that could have failed."""
    wrong = [row for row in rows if row.verdict == DIFFERS]
    able = [_one_line(row) for row in wrong if not row.published.own]
    rest = [_one_line(row) for row in wrong if row.published.own]
    lines = ["Rows that could have failed, and did:", "", *(able or ["- none"])]
    return [*lines, "", "Other rows that differ:", "", *(rest or ["- none"])]


def _one_line(row: Comparison) -> str:
    entry = row.published
    return (
        f"- {entry.quantity}: published {_published(entry)}, model"
        f" {_with_unit(row.model, entry.unit)} ({row.reason()})"
    )


def _table(rows: Sequence[Comparison]) -> list[str]:
    lines = [
        "| quantity | published | source | model | difference | tolerance | verdict | why |"
        " held against | depends on inferred | made by |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
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
            entry.own or "a measurement",
            ", ".join(f"`{key}`" for key in entry.depends_on) or "nothing",
            f"[command](#{command_anchor(entry.section)})",
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
    if row.difference is None or row.model is None:
        return _NONE
    if row.difference == 0.0:
        return "0"
    size = published_size(entry, row.model)
    share = f" ({100 * row.difference / size:+.1f} %)" if size else ""
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

    reader = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = reader.parse(text)
    for token, inside in pairwise(tokens):
        if token.type == "heading_open":
            token.attrSet("id", slug(inside.content))
    body = reader.renderer.render(tokens, reader.options, {})
    title = html.escape(text.splitlines()[0].removeprefix("# "))
    return (
        f'<!doctype html>\n<html lang="en">\n<head><meta charset="utf-8"><title>{title}</title>\n'
        f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style></head>\n'
        f"<body>\n{body}</body>\n</html>\n"
    )
