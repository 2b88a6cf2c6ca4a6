"""Checks what a shop prints of a racket, strung: numbers with units in, SI out.

A number is taken in SI; text is read with its unit (`320g`, `33 cm`, `98in2`, `24kg`). Swingweight
and twistweight without a unit are in kg cm^2, frequencies in Hz, as shops print them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from drake_racket.io.errors import InputError
from drake_racket.io.units import measure
from drake_racket.parameters.quantities import check_name
from drake_racket.parameters.racket import RACKETS, TENSIONS
from drake_racket.parameters.specs import regressions

Given = float | str | None

USUAL_LENGTH = 0.6858  # m, 27 in


@dataclass(frozen=True)
class Printed:
    """Says what one printed number is.

    Attributes:
        unit: kept in.  bare: unit of text that has none; None asks for one.
        low, high: what is taken for possible (the population's 5-95 % is well inside).
        example: of a value, for messages.
        spread: half the last digit that shops print, as a standard deviation (half / sqrt 3).

    """

    unit: str
    bare: str | None
    low: float
    high: float
    example: str
    text: str
    spread: float = 0.0


PRINTED: Mapping[str, Printed] = {
    "mass": Printed("kg", None, 0.15, 0.5, "320g", "strung mass", 0.3e-3),
    "balance": Printed("m", None, 0.2, 1.5, "33cm", "balance from the butt, strung", 0.3e-3),
    "swingweight": Printed("kg*m^2", "kg cm^2", 0.01, 0.06, "320", "swingweight, strung", 0.3e-4),
    "twistweight": Printed("kg*m^2", "kg cm^2", 5e-4, 3e-3, "14.2", "twistweight", 0.03e-4),
    "head": Printed("m^2", None, 0.045, 0.09, "98in2", "head area"),
    "length": Printed("m", None, 0.45, 0.75, "27in", "length"),
    "ra": Printed("1", "", 35.0, 90.0, "65", "flex (RA)"),
    "frequency": Printed("Hz", "", 80.0, 250.0, "148", "out-of-plane fundamental"),
}
_PATTERN = re.compile(r"(\d{2})\s*[xX\u00d7/]\s*(\d{2})")


@dataclass(frozen=True)
class Specs:
    """The specs are a shop's numbers in SI, checked one by one; None was not given.

    Attributes:
        values: by name of `PRINTED`.
        tension: `low`, `high`, or in N.
        pattern: numbers of mains and crosses.
        bed: the published racket whose string-bed is taken; empty for the first.

    """

    name: str
    title: str
    values: Mapping[str, float]
    tension: str
    pattern: tuple[int, int] | None
    bed: str

    def get(self, name: str) -> float | None:
        """Gives a number in SI, or None."""
        return self.values.get(name)

    def __getitem__(self, name: str) -> float:
        """A number in SI that must be there."""
        return self.values[name]


def read_specs(
    name: str,
    given: Mapping[str, Given],
    *,
    title: str = "",
    tension: Given = None,
    pattern: str | None = None,
    bed: str = "",
    where: str = "",
) -> Specs:
    """Checks every number for itself; what does not fit together the recipe tells.

    Args:
        given: by name of `PRINTED`.  tension: with a unit, N without one, or `low`, `high`.
        where: before the keys, in messages.

    Raises:
        InputError: naming the key, the value and what is allowed.

    """
    check_name(name, where.rstrip(", ") or "racket")
    values: dict[str, float] = {}
    for key, printed in PRINTED.items():
        value = given.get(key)
        if value is None or value == "":
            continue
        values[key] = _checked(where + key, value, printed)
    for key in ("mass", "balance", "swingweight", "head"):
        if key not in values:
            needs = f"{PRINTED[key].text}, as in {PRINTED[key].example}"
            raise InputError(where + key, "nothing", needs)
    if bed and bed not in RACKETS:
        raise InputError(f"{where}bed", bed, ", ".join(RACKETS))
    return Specs(
        name=name,
        title=title or name,
        values=values,
        tension=_tension(tension, where),
        pattern=_pattern(pattern, where),
        bed=bed,
    )


def _checked(key: str, value: Given, printed: Printed) -> float:
    number = measure(key, value, printed.unit, bare=printed.bare)
    if printed.low <= number <= printed.high:
        return number
    low, high = (as_shops_print(printed.unit, x) for x in (printed.low, printed.high))
    raise InputError(key, value, f"{low} to {high}")


def as_shops_print(unit: str, number: float) -> str:
    """Writes a number that is kept in `unit` as shops do."""
    factor, shown = {
        "kg": (1e3, "g"),
        "m": (1e2, "cm"),
        "kg*m^2": (1e4, "kg cm²"),
        "m^2": (1.0 / regressions.SQUARE_INCH, "in²"),
        "Hz": (1.0, "Hz"),
        "1": (1.0, ""),
    }[unit]
    return f"{factor * number:.4g} {shown}".rstrip()


def _tension(tension: Given, where: str) -> str:
    if tension is None or tension == "":
        return "low"
    if tension in TENSIONS:
        return str(tension)
    newton = measure(f"{where}tension", tension, "N", bare="")
    return f"{newton:.10g}"


def _pattern(pattern: str | None, where: str) -> tuple[int, int] | None:
    if not pattern:
        return None
    found = _PATTERN.fullmatch(pattern.strip())
    if found is None:
        raise InputError(f"{where}pattern", pattern, "mains x crosses, as in 16x19")
    mains, crosses = int(found[1]), int(found[2])
    if not (10 <= mains <= 22 and 10 <= crosses <= 26):
        raise InputError(f"{where}pattern", pattern, "10 to 22 mains, 10 to 26 crosses")
    return mains, crosses
