"""Makes the Python reference: every public name once, by subject, from the packages' stubs."""

from __future__ import annotations

import griffe

from manual.subjects import (
    PACKAGE,
    PACKAGES,
    ROOT,
    SUBJECTS,
    PublicName,
    public_names,
    subject_of,
)
from manual.tables import table


def api_pages() -> dict[str, str]:
    """Makes reference/python.md and a page for each subject and package."""
    loaded = griffe.load(PACKAGE, search_paths=[ROOT], resolve_aliases=True)
    face = public_names()
    at = {name.source: f"{subject_of(name)}.md" for name in face}
    pages: dict[str, str] = {}
    parts = []
    for page, (title, _) in SUBJECTS.items():
        names = [name for name in face if subject_of(name) == page]
        pages[f"reference/python/{page}.md"] = _page(title, "drake_racket", names, loaded)
        parts.append(f"## [{title}](python/{page}.md)\n\n{_index(names, page, loaded)}")
    for package, title in PACKAGES.items():
        names = public_names(package)
        own = [name for name in names if name.source not in at]
        shared = [name for name in names if name.source in at]
        page = f"{package}_package" if package in SUBJECTS else package
        text = _page(title, f"drake_racket.{package}", own, loaded)
        if shared:
            links = ", ".join(
                f"[`{n.path.split('.')[-1]}`]({at[n.source]}#{_face_path(n, face)})" for n in shared
            )
            text += f"\nAlso here, described with the face: {links}.\n"
        pages[f"reference/python/{page}.md"] = text
        head = f"## [`drake_racket.{package}`: {title}](python/{page}.md)\n\n"
        parts.append(head + _index(own, page, loaded))
    pages["reference/python.md"] = _INDEX + "\n".join(parts)
    return pages


_INDEX = """# Python

Everything that users import, by subject. `import drake_racket as dr` brings the names of the first
subjects; those of the packages below them are imported from there
(`from drake_racket.sweep import make_sweep`). Names are loaded when they are first used. Quantities
are in SI units and radians unless a name says otherwise (`_deg`); arrays have their shapes in
brackets, `(n, 3)`. Bad input raises [`InputError`](python/scripts.md#drake_racket.InputError).

"""


def _face_path(name: PublicName, face: list[PublicName]) -> str:
    return next(other.path for other in face if other.source == name.source)


def _is_enum(name: PublicName, loaded: griffe.Module) -> bool:
    member = loaded[name.path.removeprefix(f"{PACKAGE}.")]
    found = member.final_target if member.is_alias else member
    return found.is_class and any(str(base).endswith("Enum") for base in found.bases)


def _page(title: str, package: str, names: list[PublicName], loaded: griffe.Module) -> str:
    lines = [f"# {title}", "", f"Import from `{package}`.", ""]
    for name in names:
        lines += [f"::: {name.path}"]
        if _is_enum(name, loaded):  # its members say all
            lines += ["    options:", "      show_if_no_docstring: true", "      filters: ['!^_']"]
        lines.append("")
    return "\n".join(lines)


def first_line(docstring: str) -> str:
    """Gives the first sentence or paragraph of a docstring on one line."""
    return " ".join(docstring.strip().split("\n\n")[0].split())


def docstring_of(name: PublicName, loaded: griffe.Module) -> str:
    """Gives the docstring of a public name; empty if it has none."""
    member = loaded[name.path.removeprefix(f"{PACKAGE}.")]
    if member.is_alias:
        member = member.final_target
    return member.docstring.value if member.docstring else ""


def _index(names: list[PublicName], page: str, loaded: griffe.Module) -> str:
    rows = [
        (
            f"[`{name.path.split('.')[-1]}`](python/{page}.md#{name.path})",
            first_line(docstring_of(name, loaded)),
        )
        for name in names
    ]
    return table(("name", "what"), rows)
