"""Reads the published numbers and how the model is compared: data/published.yaml."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from drake_racket.io.errors import InputError
from drake_racket.io.schema import Number, OneOf, Schema, Text
from drake_racket.io.shipped import data_directory
from drake_racket.io.yaml_files import load_file

TOLERANCE_KINDS = ("relative", "absolute")

OWN = ("input", "fit", "closed form")
"""What of the model's own a row compares it with: such rows could hardly fail."""


@dataclass(frozen=True)
class PublishedValue(Schema):
    """A published value is one number or range; the head of data/published.yaml has the keys.

    Attributes:
        key: of the row.
        section: of the report.
        quantity: what the number is, in words.
        unit: of all its numbers.
        source: where it is printed.
        value: the number; None where there is a range.
        low, high: ends of a range, either of which may be None.
        tolerance: on the difference.
        tolerance_kind: `relative` to the published value, or `absolute`.
        tolerance_reason: why so much.
        not_comparable: why no verdict is possible, where that is so.
        depends_on: keys of the inferred values behind the model's number.
        own: what of the model's own the row compares it with, one of OWN; empty for a measurement.
        note: one line that the report prints beside the verdict.

    """

    key: Text = ""
    section: Text = ""
    quantity: Text = ""
    unit: Text = ""
    source: Text = ""
    value: Annotated[float, Number("1")] | None = None
    low: Annotated[float, Number("1")] | None = None
    high: Annotated[float, Number("1")] | None = None
    tolerance: Annotated[float, Number("1")] = 0.0
    tolerance_kind: Text = "relative"
    tolerance_reason: Text = ""
    not_comparable: Text = ""
    depends_on: tuple[Text, ...] = ()
    own: Annotated[str, OneOf("", *OWN)] = ""
    note: Text = ""


@dataclass(frozen=True)
class PublishedValues(Schema):
    """Holds the whole file."""

    entries: tuple[PublishedValue, ...]


def load_published(path: str | Path | None = None) -> tuple[PublishedValue, ...]:
    """Reads and checks the published numbers (the shipped ones if `path` is None).

    Raises:
        InputError: naming the entry and what is allowed.

    """
    path = None if path is None else Path(path)
    path = path or data_directory() / "published.yaml"
    entries = load_file(path, PublishedValues).entries
    seen: set[str] = set()
    for number, entry in enumerate(entries):
        where = f"{path}: entries[{number}]"
        _check(entry, where)
        if entry.key in seen:
            raise InputError(f"{where}.key", entry.key, "each key once")
        seen.add(entry.key)
    return entries


def _check(entry: PublishedValue, where: str) -> None:
    for name in ("key", "section", "quantity", "unit", "source", "note"):
        if not getattr(entry, name).strip():
            raise InputError(f"{where}.{name}", getattr(entry, name), "this key must be given")
    numbers = [entry.value, entry.low, entry.high]
    if entry.not_comparable:
        return
    if all(x is None for x in numbers):
        raise InputError(f"{where}.value", None, "value, low or high, or not_comparable")
    if entry.value is not None and (entry.low is not None or entry.high is not None):
        raise InputError(f"{where}.value", entry.value, "a value or a range, not both")
    if entry.low is not None and entry.high is not None and entry.low > entry.high:
        raise InputError(f"{where}.low", entry.low, f"at most high ({entry.high})")
    if entry.tolerance_kind not in TOLERANCE_KINDS:
        raise InputError(
            f"{where}.tolerance_kind", entry.tolerance_kind, ", ".join(TOLERANCE_KINDS)
        )
    if not entry.tolerance >= 0.0:
        raise InputError(f"{where}.tolerance", entry.tolerance, "0 or more")
    if not entry.tolerance_reason.strip():
        raise InputError(f"{where}.tolerance_reason", entry.tolerance_reason, "a reason")
