"""Says which spellings of a unit are the same, and which units are exact multiples of another.

What is not listed here is not converted: a column in such a unit is refused, not guessed at.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

_SPELLINGS = {
    "1": ("", "-", "\u2013", "\u2014"),
    "s": ("sec", "second", "seconds"),
    "ms": ("msec", "milliseconds"),
    "us": ("usec", "microseconds"),
    "m": ("metre", "metres", "meter", "meters"),
    "N": ("newton", "Newton", "newtons"),
    "kg": (),
    "g": ("gram", "grams"),
    "m/s": ("m s^-1", "m.s^-1", "mps"),
    "mm/s": ("mm s^-1",),
    "km/h": ("kmh", "km/hr", "kph", "km h^-1"),
    "m/s^2": ("m/s2", "m s^-2", "m.s^-2", "m/s/s"),
    "mm/s^2": ("mm/s2", "mm s^-2"),
    "deg": ("°", "degree", "degrees"),
    "rad": ("radian", "radians"),
}
_KNOWN = {text: unit for unit, texts in _SPELLINGS.items() for text in (unit, *texts)}
_MULTIPLES: dict[str, dict[str, tuple[float, float]]] = {
    "s": {"ms": (1.0, 1e3), "us": (1.0, 1e6)},
    "m": {"mm": (1.0, 1e3), "cm": (1.0, 1e2)},
    "N": {"kN": (1e3, 1.0), "mN": (1.0, 1e3)},
    "kg": {"g": (1.0, 1e3)},
    "m/s": {"km/h": (1.0, 3.6), "mm/s": (1.0, 1e3)},
    "m/s^2": {"mm/s^2": (1.0, 1e3)},
    "deg": {"rad": (180.0 / np.pi, 1.0)},
}
"""Unit asked for -> unit given -> (times, over)."""

# what laboratories write below a header, beside the units above: enough to know a row of units
_IN_UNITS_ROWS = {"V", "mV", "Hz", "kHz", "%", "°C", "degC", "K", "Pa", "kPa", "bar", "J", "N m"}
_IN_UNITS_ROWS |= {unit for multiples in _MULTIPLES.values() for unit in multiples}


def unit_of(text: str) -> str:
    """Gives the unit in this package's spelling; one that it does not know as it is written.

    >>> unit_of("m s⁻²"), unit_of("µs"), unit_of(" "), unit_of("mph")
    ('m/s^2', 'us', '1', 'mph')
    """
    plain = text.strip().replace("\u00b5", "u").replace("\u03bc", "u")
    plain = plain.replace("²", "^2").replace("⁻^2", "^-2").replace("⁻¹", "^-1")
    plain = re.sub(r"\s*[·*⋅]\s*", " ", plain.replace("**", "^"))
    return _KNOWN.get(plain, plain)


def is_unit(text: str) -> bool:
    """Tells whether a cell can be nothing but a unit: a known one, or anything in brackets."""
    unit = unit_of(bare) if (bare := bracketed(text)) is not None else unit_of(text)
    return bare is not None or unit in _SPELLINGS or unit in _IN_UNITS_ROWS


def bracketed(text: str) -> str | None:
    """Tells what is between the brackets of `[s]` or `(s)`; None if the text is not that."""
    found = re.fullmatch(r"\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))\s*", text)
    return None if found is None else found[1] if found[1] is not None else found[2]


def is_same(given: str, wanted: str) -> bool:
    """Tells whether two units of `unit_of` are one, whatever their case (`[S]`, say)."""
    return given == wanted or given.casefold() == wanted.casefold()


def can_convert(given: str, wanted: str) -> bool:
    """Tells whether `convert` takes it."""
    return is_same(given, wanted) or given in _MULTIPLES.get(wanted, {})


def convert(values: NDArray[np.float64], given: str, wanted: str) -> NDArray[np.float64]:
    """Gives the numbers in `given` as numbers in `wanted`, rounded once; see `can_convert`."""
    if is_same(given, wanted):
        return values
    times, over = _MULTIPLES[wanted][given]
    return values * times / over


def allowed_units(wanted: str) -> str:
    """Tells messages what can be given, ' (or kN, mN)'; nothing where there is no other."""
    others = ", ".join(_MULTIPLES.get(wanted, {}))
    return f" (or in {others})" if others else ""


def labelled(dims: str | tuple[str, ...], values: Any, units: str, long_name: str) -> Any:
    """A variable of a Dataset with the two attributes that every one carries."""
    return dims, values, {"units": units, "long_name": long_name}
