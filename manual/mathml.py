r"""Turns the formulas of a page, `$...$` and `$$...$$`, into MathML when the site is built.

Browsers set MathML themselves: no script, no font and no network is needed to read a formula.
"""

from __future__ import annotations

import html
import re

from latex2mathml.converter import convert

_FORMULA = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)


def with_mathml(page: str) -> str:
    """Replaces the marked formulas that pymdownx.arithmatex leaves, by MathML."""

    def formula(found: re.Match[str]) -> str:
        display = "block" if found[2] == "[" else "inline"
        tex = html.unescape(found[3]).strip()
        text: str = convert(tex, display=display)
        return text.replace("<math ", f'<math aria-label="{html.escape(tex, quote=True)}" ', 1)

    return _FORMULA.sub(formula, page)
