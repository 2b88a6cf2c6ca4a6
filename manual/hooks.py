"""Adds to the site what is made of the package: MkDocs calls these functions while it builds."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from manual.mathml import with_mathml  # noqa: E402
from manual.notebooks import notebook_page  # noqa: E402
from manual.reference import generated_pages  # noqa: E402
from manual.terms import with_links  # noqa: E402

TABLES = ("cpu_times.md", "identification_tables.md", "mutants.md", "same_numbers.md")
COPIED = {"changelog.md": "CHANGELOG.md", "contributing.md": "CONTRIBUTING.md"}


def on_config(config: Any) -> Any:
    """Puts pages of docs/ that the navigation does not name under Explanation, so none is lost."""
    named = str(config.nav)
    explanation = next(part["Explanation"] for part in config.nav if "Explanation" in part)
    for path in sorted((ROOT / "docs").glob("*.md")):
        if f"'{path.name}'" not in named:
            explanation.insert(-1, path.name)  # before the studies
    return config


def on_files(files: Any, config: Any) -> Any:
    """Adds the reference, the notebooks, and the pages that lie beside the README."""
    pages: dict[str, str | bytes] = dict(generated_pages())
    for page, source in COPIED.items():
        text = (ROOT / source).read_text(encoding="utf-8")
        pages[page] = text.replace("](docs/", "](")
    for path in sorted((ROOT / "docs" / "tutorials").glob("*.ipynb")):
        found = notebook_page(path)
        pages[f"tutorials/{path.stem}.md"] = found.text
        pages |= {f"tutorials/{name}": data for name, data in found.pictures.items()}
    for name, content in pages.items():
        files.append(File.generated(config, name, content=content))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Links the glossary where a page uses its words first; keeps long tables out of the search."""
    if page.file.src_uri in TABLES:
        page.meta["search"] = {"exclude": True}
    return with_links(markdown, page.file.src_uri)


def on_page_content(html: str, page: Any, config: Any, files: Any) -> str:
    """Sets the formulas."""
    return with_mathml(html)
