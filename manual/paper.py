"""Writes the validation table of docs/paper.md from the report's rows: python -m manual.paper."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

from manual.tables import table

DOCS = Path(__file__).resolve().parents[1] / "docs"
BEGIN, END = "<!-- from docs/validation/rows.json: python -m manual.paper -->\n", "<!-- end -->\n"

KINDS = {
    "": "a measurement that the model never saw",
    "fit": "a number that had a say in a fitted or inferred value",
    "input": "the model's own input",
    "closed form": "a closed form, or the same equations in another way",
}


def validation_table(rows: list[dict[str, Any]]) -> str:
    """Counts the verdicts of each kind of row, as a Markdown table."""
    lines = []
    for kind, said in KINDS.items():
        verdicts = Counter(row["verdict"] for row in rows if row["own"] == kind)
        counts = [verdicts[v] for v in ("agrees", "differs", "not comparable")]
        lines.append((said, sum(counts), *counts))
    return table(("held against", "rows", "agree", "differ", "not comparable"), lines)


def with_table(text: str, rows: list[dict[str, Any]]) -> str:
    """Gives the paper with the table between its two marks made anew."""
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    return f"{before}{BEGIN}\n{validation_table(rows)}\n{END}{after}"


def main() -> None:
    """Rewrites the paper's table."""
    rows = json.loads((DOCS / "validation" / "rows.json").read_text(encoding="utf-8"))
    path = DOCS / "paper.md"
    path.write_text(with_table(path.read_text(encoding="utf-8"), rows), encoding="utf-8")
    print(f"wrote {path.name}")


if __name__ == "__main__":
    main()
