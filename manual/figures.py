"""Gives every picture that stands alone a caption: the italic line below it, or its text."""

from __future__ import annotations

import re

_ALONE = re.compile(r'<p>(<img alt="([^"]*)"[^>]*>)</p>(?:\s*<p><em>(.*?)</em></p>)?', re.DOTALL)
_FRONT = '<div class="front">'


def with_captions(page: str) -> str:
    """Turns the pictures of a page into figures; the front page's stays as it is."""
    if _FRONT in page:
        return page

    def figure(found: re.Match[str]) -> str:
        picture, text, caption = found.groups()
        return f"<figure>{picture}<figcaption>{caption or text}</figcaption></figure>"

    return _ALONE.sub(figure, page)
