"""Says which spellings of a unit are the same, and which units are exact multiples of another.

Columns have theirs in the header; single numbers (`measure`) have it behind them, as people write
them: `320g`, `33 cm`, `55lb`. What is not listed here is refused, not guessed at.
"""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError
from drake_racket.io.numbers import as_number

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


_POUND, _GRAVITY = 0.45359237, 9.80665

_FACTORS: dict[str, dict[str, float]] = {
    "m": {"in": 0.0254, '"': 0.0254, "inch": 0.0254, "inches": 0.0254, "ft": 0.3048},
    "kg": {"lb": _POUND, "lbs": _POUND, "oz": _POUND / 16},
    "m^2": {"cm^2": 1e-4, "cm2": 1e-4, "in^2": 0.0254**2, "in2": 0.0254**2, "sq in": 0.0254**2},
    "kg*m^2": {
        "kg m^2": 1.0,
        "kgm2": 1.0,
        "kg cm^2": 1e-4,
        "kgcm2": 1e-4,
        "kg cm2": 1e-4,
        "kgcm^2": 1e-4,
        "g cm^2": 1e-7,
    },
    "m/s": {"mph": 0.44704, "ft/s": 0.3048},
    "N": {
        "kgf": _GRAVITY,
        "kp": _GRAVITY,
        "kg": _GRAVITY,
        "lbf": _POUND * _GRAVITY,
        "lb": _POUND * _GRAVITY,
        "lbs": _POUND * _GRAVITY,
    },
    "rad/s": {"rpm": math.pi / 30.0, "deg/s": math.pi / 180.0, "°/s": math.pi / 180.0},
    "rpm": {"rad/s": 30.0 / math.pi, "1/min": 1.0},
    "degrees": {"deg": 1.0, "°": 1.0, "rad": 180.0 / math.pi},
    "rad": {"deg": math.pi / 180.0, "°": math.pi / 180.0},
    "Hz": {"kHz": 1e3, "1/s": 1.0},
    "N/m": {"kN/m": 1e3, "N/mm": 1e3},
    "N*m/rad": {"N m/rad": 1.0, "Nm/rad": 1.0},
    "m/s^2": {"g0": _GRAVITY},
    "1": {"%": 0.01},
}
"""Of a single number: unit asked for -> unit given -> how many of the first. Exact by definition:
the inch and the pound of 1959, the standard gravity of 1901 for tensions given in kg or lb."""

_MEASURE = re.compile(r"\s*([-+]?(?:\.\d+|\d+(?:\.\d*)?)(?:[eE][-+]?\d+)?)\s*(.*?)\s*", re.ASCII)
_SHOWN = {
    "m": "mm, cm, m, in",
    "kg": "g, kg, oz, lb",
    "m^2": "in2, cm2",
    "kg*m^2": "kgcm2, kg*m^2",
    "m/s": "m/s, km/h, mph",
    "N": "N, kg, lb",
    "rad/s": "rad/s, rpm, deg/s",
    "rpm": "rpm, rad/s",
    "degrees": "deg, rad",
    "s": "s, ms",
    "Hz": "Hz",
}


def units_shown(unit: str) -> str:
    """Tells messages which units may stand behind a number that is kept in `unit`."""
    return _SHOWN.get(unit, unit)


def measure(key: str, value: object, unit: str, *, bare: str | None = None) -> float:
    """Gives a number in `unit`: a number is taken as it is, text is read with its unit.

    Args:
        key: for messages.  value: a number, or text such as `320g`, `0.33 m`, `55lb`.
        unit: wanted, in the spelling of the parameter files.
        bare: unit of text without one; None refuses such text where there is more than one unit
            to mean, and "" takes `unit`.

    Raises:
        InputError: no finite number, or a unit that is no multiple of the one wanted.

    """
    if not isinstance(value, str):
        number = as_number(value)
        if number is None or not math.isfinite(number):
            raise InputError(key, value, f"a finite number ({unit}), or text with its unit")
        return number
    found = _MEASURE.fullmatch(value)
    allowed = f"a number with its unit ({units_shown(unit)})"
    if found is None:
        raise InputError(key, value, allowed)
    number, given = float(found[1]), found[2] or (unit if bare == "" else bare)
    if given is None:
        raise InputError(key, value, allowed)
    converted = converted_to(number, given, unit)
    if converted is None or not math.isfinite(converted):
        raise InputError(key, value, allowed)
    return converted


def converted_to(number: float, given: str, unit: str) -> float | None:
    """Gives a number in another unit; None where the one is no multiple of the other."""
    plain = unit_of(given)
    own = {"m^2": "m^2", "degrees": "deg"}.get(unit, unit)
    if plain in (unit, unit_of(unit)) or given == unit:
        return number
    for spelling in (given, plain):
        factor = _FACTORS.get(unit, {}).get(spelling)
        if factor is not None:
            return number * factor
    if plain in _MULTIPLES.get(own, {}):
        return float(convert(np.array([number]), plain, own)[0])
    return None


def labelled(dims: str | tuple[str, ...], values: Any, units: str, long_name: str) -> Any:
    """A variable of a Dataset with the two attributes that every one carries."""
    return dims, values, {"units": units, "long_name": long_name}
