"""Reads the sections of this package's docstrings: several names may share a line or a text.

`force, torque: (3,) on the hand.` says the same of two names; `time: s.  step: s.` are two entries.
"""

from __future__ import annotations

import re

_HEADS = ("Args:", "Attributes:")
_ENTRY = r"[*]{0,2}\w+(?:, [*]{0,2}\w+)*: "


def one_name_a_line(docstring: str) -> str:
    """Gives a docstring in which every name of Args and Attributes has a line of its own."""
    lines: list[str] = []
    indent: int | None = None  # of the entries of the section that is read
    inside = False
    for line in docstring.split("\n"):
        stripped = line.strip()
        depth = len(line) - len(line.lstrip())
        if stripped in _HEADS:
            inside, indent = True, None
        elif inside and stripped:
            indent = depth if indent is None else indent
            if depth < indent:
                inside = False
            elif depth == indent:
                lines += _entries(stripped, " " * depth)
                continue
            elif (found := _later_entry(stripped)) is not None:
                before, after = found
                lines += [" " * depth + before, *_entries(after, " " * indent)]
                continue
        lines.append(line)
    return "\n".join(_shared(lines))


def _later_entry(text: str) -> tuple[str, str] | None:
    """Parts a continued line where another entry begins after two blanks."""
    found = re.search(rf"(?<=\S)  (?={_ENTRY})", text)
    return None if found is None else (text[: found.start()], text[found.end() :])


def _entries(text: str, margin: str) -> list[str]:
    return [margin + part for part in re.split(rf"(?<=\S)  (?={_ENTRY})", text)]


def _shared(lines: list[str]) -> list[str]:
    """Repeats a text for each of the names that share it."""
    out: list[str] = []
    i = 0
    while i < len(lines):
        found = re.match(rf"(\s+)({_ENTRY})(.*)", lines[i])
        if found is None or "," not in found[2]:
            out.append(lines[i])
            i += 1
            continue
        margin, names, text = found[1], found[2][:-2].split(", "), found[3]
        more = []
        while i + 1 < len(lines) and lines[i + 1].startswith(margin + " "):
            i += 1
            more.append(lines[i])
        for name in names:
            out += [f"{margin}{name}: {text}", *more]
        i += 1
    return out
