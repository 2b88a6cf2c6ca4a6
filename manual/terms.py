"""Links the words of the glossary where a page uses them first."""

from __future__ import annotations

import posixpath
import re

GLOSSARY = "reference/glossary.md"

TERMS = {
    "apparent restitution": "apparent-restitution",
    "swingweight": "swingweight",
    "twistweight": "twistweight",
    "stringing tension": "stringing-tension",
    "RA": "ra",
    "GSC": "gsc",
    "T0": "t0",
    "kb": "kb",
    "kf": "kf",
    "mains": "mains",
    "sweet spots": "sweet-spot",
    "centre of percussion": "percussion",
}
"""Word -> its anchor. Words of lower case are found in any case, the others as they are."""

_LEFT_ALONE = re.compile(
    r"```.*?```"  # code
    r"|^ {4}.*?$"
    r"|^#.*?$"  # headings
    r"|^!?\[[^\]]*\]\([^)]*\)$"
    r"|`[^`\n]*`"
    r"|!?\[[^\]]*\]\([^)]*\)(?:\{[^}]*\})?"  # links and pictures
    r"|\$[^$]*\$"  # formulas
    r"|<(table|details|div)\b.*?</\1>"  # what a notebook shows of an object
    r"|<[^>]*>"
    r"|^---\n.*?\n---$",
    re.DOTALL | re.MULTILINE,
)


def with_links(text: str, page: str) -> str:
    """Gives a page's Markdown with the first use of each term linked to the glossary.

    Args:
        text: Markdown.
        page: its place in docs/.

    """
    if page == GLOSSARY or page.startswith("reference/"):
        return text
    target = posixpath.relpath(GLOSSARY, posixpath.dirname(page) or ".")
    pieces: list[str] = []
    end = 0
    for skipped in _LEFT_ALONE.finditer(text):
        pieces += [text[end : skipped.start()], skipped[0]]
        end = skipped.end()
    pieces.append(text[end:])
    for term, anchor in TERMS.items():
        flags = re.IGNORECASE if term.islower() and len(term) > 2 else 0
        pattern = re.compile(rf"(?<![\w./-]){re.escape(term)}(?![\w/-])", flags)
        for i in range(0, len(pieces), 2):  # the others are left alone
            found = pattern.search(pieces[i])
            if found is not None:
                link = f"[{found[0]}]({target}#{anchor})"
                before, after = pieces[i][: found.start()], pieces[i][found.end() :]
                pieces[i : i + 1] = [before, link, after]
                break
    return "".join(pieces)
