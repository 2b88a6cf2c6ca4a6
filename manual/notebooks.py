"""Turns the tutorials' notebooks into pages: nbconvert's Markdown, and their pictures."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import nbformat
from nbconvert import MarkdownExporter


@dataclass(frozen=True)
class NotebookPage:
    """A notebook page is Markdown, and the pictures that it names."""

    text: str
    pictures: dict[str, bytes]


def notebook_page(path: Path) -> NotebookPage:
    """Converts a notebook with its stored outputs.

    Pictures get the text alternative that their cell gives in its metadata (`alt`).
    """
    notebook = nbformat.read(path, as_version=4)
    text, resources = MarkdownExporter().from_notebook_node(
        notebook, {"unique_key": path.stem, "output_files_dir": path.stem}
    )
    pictures = {name: bytes(data) for name, data in resources["outputs"].items()}
    alternatives = iter(
        cell["metadata"].get("alt", "") for cell in notebook.cells if _has_picture(cell)
    )
    text = re.sub(r"!\[png\]", lambda _: f"![{next(alternatives)}]", text)
    text = _marked_outputs(text)
    download = f"[Download this page as a notebook]({path.name}){{ .md-button download }}\n"
    return NotebookPage(f"{text}\n{download}", pictures)


def _has_picture(cell: nbformat.NotebookNode) -> bool:
    return any("image/png" in output.get("data", {}) for output in cell.get("outputs", []))


def _marked_outputs(text: str) -> str:
    """Fences the printed output, which nbconvert indents: it would else look like source."""
    lines: list[str] = []
    fenced = inside = False
    for line in text.split("\n"):
        if line.startswith("```"):
            inside = not inside
        if not inside and not fenced and line.startswith("    ") and line.strip():
            lines.append('``` { .text .no-copy title="prints" }')
            fenced = True
        elif fenced and line.strip() and not line.startswith("    "):
            while lines[-1] == "":
                lines.pop()
            lines += ["```", ""]
            fenced = False
        lines.append(line[4:] if fenced else line)
    if fenced:
        while lines[-1] == "":
            lines.pop()
        lines.append("```")
    return "\n".join(lines)
