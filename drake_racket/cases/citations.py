"""Says what to cite: the software, the model's paper, and the sources of a case's numbers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version
from typing import Annotated

from drake_racket.cases.case import Case, resolve
from drake_racket.io.schema import OneOf, Schema, Text, Whole
from drake_racket.io.shipped import data_directory
from drake_racket.io.yaml_files import load_file
from drake_racket.parameters.quantities import Sourced, Spread, sourced_fields
from drake_racket.parameters.scenario import Scenario

ALWAYS = ("glynn2011", "drake")
"""Keys of what every use of the package cites: the model's paper, and Drake."""


@dataclass(frozen=True)
class Reference(Schema):
    """A reference is one publication, or one program, with what is known of it.

    Attributes:
        key: short name, as in BibTeX.
        marks: texts by which the source of a number names it.
        kind: of BibTeX's entries.
        authors: family name first.
        where: the journal.

    """

    key: Text
    kind: Annotated[str, OneOf("article", "book", "misc", "software")]
    authors: tuple[Text, ...]
    title: Text
    marks: tuple[Text, ...] = ()
    where: Text = ""
    volume: Text = ""
    number: Text = ""
    pages: Text = ""
    year: Annotated[int, Whole(1000, 3000)] | None = None
    doi: Text = ""
    url: Text = ""

    def text(self) -> str:
        """Gives the reference on one line."""
        year = "" if self.year is None else f" ({self.year})"
        place = self.where + (f" {self.volume}" if self.volume else "")
        place += f"({self.number})" if self.number else ""
        place += f":{self.pages}" if self.pages else ""
        link = f"doi:{self.doi}" if self.doi else self.url
        parts = [f"{'; '.join(self.authors)}{year}", self.title, place, link]
        return ". ".join(part for part in parts if part) + "."

    def bibtex(self) -> str:
        """Gives the reference as an entry of BibTeX."""
        named = (
            ("author", " and ".join(_protected(name) for name in self.authors)),
            ("title", f"{{{self.title}}}"),
            ("journal", self.where),
            ("volume", self.volume),
            ("number", self.number),
            ("pages", self.pages.replace("-", "--")),
            ("year", "" if self.year is None else str(self.year)),
            ("doi", self.doi),
            ("url", self.url),
        )
        lines = [f"  {name} = {{{value}}}," for name, value in named if value not in ("", "{}")]
        return "\n".join([f"@{self.kind}{{{self.key},", *lines, "}"])


def _protected(name: str) -> str:
    """A name without a comma is an organisation's: BibTeX must not take it apart."""
    return name if "," in name else f"{{{name}}}"


@dataclass(frozen=True)
class _References(Schema):
    references: tuple[Reference, ...]


@dataclass(frozen=True)
class Citation:
    """A citation is a reference, or a source that is none of them, with what it is cited for.

    Attributes:
        reference: None for a source that only its text names, in a file of the user's own, say.
        source: that text.
        numbers: keys of the numbers that come from there.

    """

    reference: Reference | None
    source: str
    numbers: tuple[str, ...] = ()

    def text(self) -> str:
        """Gives it on one line, without the numbers."""
        return self.source if self.reference is None else self.reference.text()


def citations(scenario: Scenario | Case | None = None) -> tuple[Citation, ...]:
    """Lists what to cite: the software, the model's paper and Drake, and the sources of a case.

    Args:
        scenario: of which the sources of all numbers that are not inferred are added.

    Raises:
        InputError: the scenario is not valid.

    """
    known = load_file(data_directory() / "references.yaml", _References).references
    numbers: dict[str, list[str]] = {key: [] for key in ALWAYS}
    others: dict[str, list[str]] = {}
    if scenario is not None:
        case = scenario if isinstance(scenario, Case) else resolve(scenario)
        for key, found in _numbers(case):
            named = [r.key for r in known if any(mark in found.source for mark in r.marks)]
            for name in named:
                numbers.setdefault(name, []).append(key)
            if not named and found.status not in ("inferred", "calculated"):
                others.setdefault(found.source, []).append(key)
    cited = [Citation(_software(), "")]
    by_key = {reference.key: reference for reference in known}
    cited += [Citation(by_key[key], "", tuple(keys)) for key, keys in numbers.items()]
    cited += [Citation(None, source, tuple(keys)) for source, keys in others.items()]
    return tuple(cited)


def _software() -> Reference:
    title = "drake_racket: tennis racket and ball impacts as Drake multibody systems"
    title = f"{title}, version {version('drake-racket')}"
    return Reference("drake_racket", "software", ("The drake_racket authors",), title)


def _numbers(case: Case) -> Iterator[tuple[str, Sourced | Spread]]:
    """The numbers that the case uses: no grip without a hand, no ball's surface without spin."""
    yield from sourced_fields(case.racket, "racket")
    for name, given in case.racket.specs.items():
        yield f"racket.specs.{name}", given
    idle = tuple(f"ball.{name}" for name in case.scenario.idle_of_ball(case.ball))
    for key, found in sourced_fields(case.ball, "ball"):
        if not key.startswith(idle):
            yield key, found
    held = case.scenario.support in ("grip", "limb")
    if held and case.scenario.grip_kind != "weld":
        yield from sourced_fields(case.grip, "grip")
    if case.limb is not None:
        yield from sourced_fields(case.limb, "limb")
