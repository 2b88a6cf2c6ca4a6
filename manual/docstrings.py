"""Hands this package's docstrings to griffe, and with it to mkdocstrings."""

from __future__ import annotations

from typing import Any

import griffe

from manual.shared_names import one_name_a_line


class SharedNames(griffe.Extension):
    """Gives griffe, and with it mkdocstrings, docstrings in the form that it reads."""

    def on_instance(self, *, obj: Any, **_: Any) -> None:
        """Rewrites one docstring."""
        if obj.docstring is not None:
            obj.docstring.value = one_name_a_line(obj.docstring.value)
