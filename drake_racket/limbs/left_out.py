"""Lists what an import leaves out, by name, and shortens lists of names for messages."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class LeftOutItem:
    """Holds one kind of thing: what it is, what became of it, the names of all of them."""

    kind: str
    fate: str
    names: tuple[str, ...]


@dataclass(frozen=True)
class LeftOut:
    """Holds all that a model has and the import does not carry over."""

    items: tuple[LeftOutItem, ...]

    def names(self, kind: str) -> tuple[str, ...]:
        """Gives names of one kind; empty if the model has none of it."""
        return next((item.names for item in self.items if item.kind == kind), ())

    def table(self) -> str:
        """Gives a line per kind: how many, what became of them, the first names."""
        if not self.items:
            return "nothing left out"
        kind, fate = (max(len(getattr(i, key)) for i in self.items) for key in ("kind", "fate"))
        return "\n".join(
            f"{len(i.names):5d}  {i.kind:{kind}}  {i.fate:{fate}}  {short_list(i.names, 4)}"
            for i in self.items
        )


def short_list(names: Iterable[str], limit: int = 12) -> str:
    """Gives names for a message: the first few, and how many more."""
    names = [name for name in names if name]
    more = f", ... ({len(names)} in all)" if len(names) > limit else ""
    return (", ".join(names[:limit]) or "none there") + more
