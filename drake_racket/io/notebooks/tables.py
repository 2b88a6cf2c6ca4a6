"""Writes small HTML tables, which notebooks show in place of an object's one-line text."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

_CELL = "text-align:left;padding:0.1em 0.8em 0.1em 0;vertical-align:top"


def html_table(
    title: str,
    rows: Iterable[Sequence[str]],
    *,
    head: Sequence[str] = (),
    below: str = "",
    folded: bool = False,
) -> str:
    """Gives a titled table as HTML; every text is escaped.

    Args:
        title: above it.
        rows: cells, the first of each the row's name.
        head: names of the columns, if they have any.
        below: a line under it.
        folded: only the title shows until a reader opens it.

    """
    outer, inner = ("details", "summary") if folded else ("div", "strong")
    lines = [f"<{outer}><{inner}>{escape(title)}</{inner}>", "<table>"]
    if head:
        cells = "".join(f'<th style="{_CELL}">{escape(text)}</th>' for text in head)
        lines.append(f"<thead><tr>{cells}</tr></thead>")
    lines.append("<tbody>")
    for row in rows:
        cells = "".join(f'<td style="{_CELL}">{escape(str(text))}</td>' for text in row)
        lines.append(f"<tr>{cells}</tr>")
    lines.append("</tbody></table>")
    if below:
        lines.append(f"<div>{escape(below)}</div>")
    return "\n".join([*lines, f"</{outer}>"])
