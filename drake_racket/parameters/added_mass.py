"""Adds point masses to a racket's frame: lead tape on the rim, a weight in the butt.

Exact: a point mass mu at p changes a part of mass m with its centre of mass at c by the
parallel-axis theorem. With M = m + mu, d = p - c and the reduced mass r = m mu / M,

    c' = c + (mu / M) d,
    Ixx += r dy^2,   Iyy += r dx^2,   Izz += r (dx^2 + dy^2),   Ixy -= r dx dy

Places: an hour of the clock on the rim, seen with the tip up and the ball coming towards the eye
(12 is the tip, 3 on the right, at -y); `butt`, `tip`; or a distance from the butt on the long axis.
An hour is a mass on the head; what is closer to the butt than the throat joint is on the handle.
"""

from __future__ import annotations

import dataclasses
import math

from drake_racket.io.errors import InputError
from drake_racket.io.numbers import as_number
from drake_racket.io.units import measure
from drake_racket.parameters.frame import Part
from drake_racket.parameters.quantities import Quantity
from drake_racket.parameters.racket import AddedMass, RacketParameters, check_racket

MOST = 0.2  # kg
_BALANCED = 1e-14
"""Of a length or product, below which two masses are taken to balance (round-off)."""


def place_of(racket: RacketParameters, at: str | float | tuple[float, float]) -> AddedMass:
    """Gives a place on the frame, as an added mass of 0.

    Args:
        at: an hour (1 to 12), `butt`, `tip`, a distance from the butt with its unit (`20cm`), or
            (x, y) (m) from the butt and the long axis.

    Raises:
        InputError: none of these, or off the racket.

    """
    length = racket.handle.length.value + racket.head.length.value
    if isinstance(at, tuple):
        x, y = (measure("at", value, "m") for value in at)
        return _on_racket(x, y, str(at), length)
    hour = as_number(at)
    if hour is not None:
        if hour not in range(1, 13):
            raise InputError("at", at, "an hour from 1 to 12, butt, tip, or a distance (20cm)")
        x, y = _rim(racket, math.radians(30.0 * hour))
        return AddedMass(0.0, x, y, f"{hour:g}")
    text = str(at).strip()
    if text in ("butt", "tip"):
        return AddedMass(0.0, 0.0 if text == "butt" else length, 0.0, text)
    try:
        x = measure("at", text, "m")
    except InputError:
        allowed = "an hour from 1 to 12, butt, tip, or a distance from the butt (20cm)"
        raise InputError("at", at, allowed) from None
    return _on_racket(x, 0.0, text, length)


def _on_racket(x: float, y: float, text: str, length: float) -> AddedMass:
    if not 0.0 <= x <= length:
        raise InputError("at", text, f"0 to the racket's length, {1e2 * length:.4g} cm")
    if abs(y) > length / 2.0:
        raise InputError("at", text, "a place on the racket")
    return AddedMass(0.0, x, y, text)


def _rim(racket: RacketParameters, angle: float) -> tuple[float, float]:
    """Where the clock's hand meets the rim, exactly on the axes at 3, 6, 9 and 12."""
    bed = racket.string_bed
    a, b = bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
    along, across = (round(f(angle), 15) for f in (math.cos, math.sin))
    radius = 1.0 / math.hypot(along / a, across / b)
    centre = racket.handle.length.value + bed.gsc.value
    return centre + radius * along, -radius * across + 0.0


def add_mass(
    racket: RacketParameters,
    mass: float | str,
    at: str | float | tuple[float, float],
    *,
    name: str | None = None,
    title: str | None = None,
) -> RacketParameters:
    """Adds a point mass to the frame; see the module for places and equations.

    Args:
        racket: is left as it is.
        mass: kg, or text with its unit (`5g`).
        at: 3 (o'clock), `"butt"`, `"20cm"`, or (x, y) in m.
        name, title: of the new racket; the old one's if None.

    Raises:
        InputError: a mass that is not above 0, or a place off the racket.

    """
    amount = measure("mass", mass, "kg")
    if not 0.0 < amount <= MOST:
        raise InputError("mass", mass, f"more than 0, up to {1e3 * MOST:g} g")
    added = dataclasses.replace(place_of(racket, at), mass=amount)
    new = dataclasses.replace(
        with_mass(racket, added),
        added=(*racket.added, added),
        name=name or racket.name,
        title=title or racket.title,
    )
    check_racket(new, new.name)
    return new


def with_mass(racket: RacketParameters, added: AddedMass) -> RacketParameters:
    """Gives the racket with one more mass in its parts; `added` of the racket stays."""
    throat = racket.handle.length.value
    on_head = added.at.isdigit() or added.x >= throat
    place = (added.x - throat, added.y) if on_head else (added.x, added.y)
    text = f"{1e3 * added.mass:.6g} g at {1e3 * added.x:.6g} mm, {1e3 * added.y:.6g} mm aside"
    if on_head:
        return dataclasses.replace(racket, head=_heavier(racket.head, added.mass, place, text))
    return dataclasses.replace(racket, handle=_heavier(racket.handle, added.mass, place, text))


def readded(racket: RacketParameters) -> RacketParameters:
    """Gives a racket whose parts were made anew with the masses that it has had added."""
    for added in racket.added:
        racket = with_mass(racket, added)
    return racket


def _heavier(part: Part, mass: float, place: tuple[float, float], text: str) -> Part:
    old = part.mass.value
    total, (x, y) = old + mass, part.centre()
    reduced, dx, dy = old * mass / total, place[0] - x, place[1] - y
    along, across, normal = part.moments()
    moments = {
        "moi_longitudinal": along + reduced * dy * dy,
        "moi_transverse": across + reduced * dx * dx,
        "moi_frontal": normal + reduced * (dx * dx + dy * dy),
    }
    values = {"mass": total, "com": x + mass / total * dx, **moments}
    changed: dict[str, Quantity | None] = {
        key: _changed(getattr(part, key), value, text)
        for key, value in values.items()
        if value != getattr(part, key).value
    }
    sides = {
        "com_y": (y + mass / total * dy, part.com_y, "m", part.length.value),
        "product_xy": (
            part.product() - reduced * dx * dy,
            part.product_xy,
            "kg*m^2",
            moments["moi_frontal"],
        ),
    }
    even = "0: alike on both sides before masses were added"
    for key, (value, before, unit, scale) in sides.items():
        if abs(value) <= _BALANCED * scale:
            changed[key] = None
        else:
            was = before or Quantity(0.0, unit, "calculated", even)
            changed[key] = _changed(was, value, text)
    return dataclasses.replace(part, **changed)  # type: ignore[arg-type]


def _changed(old: Quantity, value: float, text: str) -> Quantity:
    """What is calculated from a printed number is calculated; other statuses stay."""
    status = "calculated" if old.status == "printed" else old.status
    return Quantity(value, old.unit, status, f"with {text} added; {old.source}")
