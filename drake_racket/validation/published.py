"""The published numbers and how the model is compared with them: data/published.yaml.

Drake's typed YAML reads the annotations of these classes as types: they are not postponed here.
"""

from dataclasses import dataclass, field
from pathlib import Path

from drake_racket.io.errors import InputError
from drake_racket.io.shipped import data_directory
from drake_racket.io.yaml_files import load_file

TOLERANCE_KINDS = ("relative", "absolute")


@dataclass
class PublishedValue:
    """One published number or range; see the head of data/published.yaml for the keys."""

    key: str = ""
    section: str = ""
    quantity: str = ""
    unit: str = ""
    source: str = ""
    value: float | None = None
    low: float | None = None
    high: float | None = None
    tolerance: float = 0.0
    tolerance_kind: str = "relative"
    tolerance_reason: str = ""
    not_comparable: str = ""
    depends_on: list[str] = field(default_factory=list)
    note: str = ""


@dataclass
class PublishedValues:
    """The whole file."""

    entries: list[PublishedValue] = field(default_factory=list)


def load_published(path: Path | None = None) -> list[PublishedValue]:
    """Reads and checks the published numbers (the shipped ones if `path` is None).

    Raises:
        InputError: naming the entry and what is allowed.

    """
    path = path or data_directory() / "published.yaml"
    entries = load_file(path, PublishedValues, complete=False).entries
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
