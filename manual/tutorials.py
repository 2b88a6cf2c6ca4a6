"""Runs the tutorials and keeps their outputs: python -m manual.tutorials."""

from __future__ import annotations

import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient

TUTORIALS = Path(__file__).resolve().parents[1] / "docs" / "tutorials"


def run(path: Path) -> nbformat.NotebookNode:
    """Runs a notebook in an empty directory and gives it with its new outputs.

    Raises:
        CellExecutionError: a cell failed.

    """
    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as directory:
        client = NotebookClient(notebook, timeout=300, resources={"metadata": {"path": directory}})
        client.execute()
    for cell in notebook.cells:
        cell["metadata"].pop("execution", None)  # times of day
    notebook["metadata"]["language_info"] = {"name": "python"}
    return notebook


def printed(notebook: nbformat.NotebookNode) -> list[str]:
    """Gives what each code cell prints, and the text of its value."""
    texts = []
    for cell in notebook.cells:
        if cell["cell_type"] != "code":
            continue
        parts = [o["text"] for o in cell["outputs"] if o["output_type"] == "stream"]
        parts += [o["data"].get("text/plain", "") for o in cell["outputs"] if "data" in o]
        texts.append("".join(parts))
    return texts


def main() -> None:
    """Runs all of them and writes them back."""
    for path in sorted(TUTORIALS.glob("*.ipynb")):
        nbformat.write(run(path), path)
        print(f"wrote {path.name}")


if __name__ == "__main__":
    main()
