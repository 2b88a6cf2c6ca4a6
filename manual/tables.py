"""Makes Markdown tables."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Makes a Markdown table; bars in cells are escaped, line breaks become blanks."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(_cell(cell) for cell in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def _cell(value: object) -> str:
    return " ".join(str(value).replace("|", "\\|").split())


def code(value: object) -> str:
    """Sets a value as code; nothing stays nothing."""
    text = str(value)
    return f"`{text}`" if text else ""


def unit(text: str) -> str:
    """Gives a unit as it is read: nothing for a pure number, powers and dots as such."""
    shown = text.replace("^2", "²").replace("*", " ")
    return "" if text == "1" else shown
