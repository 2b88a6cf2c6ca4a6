"""Sets single numbers of racket, ball and grip by their dotted keys.

    racket.head.mass, ball.stiffness_low           as in the parameter files
    racket.string_bed.stiffness.k1                 a member of a list: k, p, mu and its number; x, y
    racket.friction.coefficients.mu2, grip.torque_stiffness.z            and z of a grip's lists
    racket.throat_joint.out_of_plane_stiffness     in_plane_, out_of_plane_ stiffness and damping:
                                                   the printed label that stands for it is set
    racket.string_bed.spring.left-4                k (N/m) of one spring

One spring's own k takes the bed apart into one stiffness a spring without rim factors; the others
keep what they have, after all keys that name a k or a p. The stringing tension has no key: it is a
label, and the model's number is `initial_tension`.
"""

from __future__ import annotations

import dataclasses
import difflib
from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar, cast

from drake_racket.io.errors import InputError
from drake_racket.io.numbers import as_number, finite_number
from drake_racket.io.units import measure
from drake_racket.laws.bed import spring_formula
from drake_racket.parameters.ball import BallParameters, check_ball
from drake_racket.parameters.grip import GripStiffness, check_grip
from drake_racket.parameters.quantities import Assignment, Quantities, Quantity, sourced_fields
from drake_racket.parameters.racket import RacketParameters, check_racket

P = TypeVar("P", RacketParameters, BallParameters, GripStiffness)

SPRING = "racket.string_bed.spring."
_LABELS = frozenset({"racket.string_bed.stringing_tension"})
_MEMBERS: dict[str, Callable[[int], str]] = {
    "stiffness": lambda i: f"k{i + 1}",
    "rim_factors": lambda i: f"p{i + 1}",
    "coefficients": lambda i: f"mu{i + 1}",
}
_CHECKS: dict[type, Callable[[Any, str, Iterable[tuple[str, ...]] | None], None]] = {
    RacketParameters: check_racket,
    BallParameters: check_ball,
    GripStiffness: check_grip,
}
_PREFIXES: dict[type, str] = {
    RacketParameters: "racket",
    BallParameters: "ball",
    GripStiffness: "grip",
}


@dataclass(frozen=True)
class ParameterKey:
    """A ParameterKey says what a key stands for: the `value` that it has now, and its `unit`."""

    unit: str
    value: float


@dataclass(frozen=True)
class _Place:
    """Where a key's number stands: attributes below the parameters, and its place in a list."""

    path: tuple[str, ...]
    member: int | None
    unit: str
    value: float


def parameter_keys(
    racket: RacketParameters, ball: BallParameters, grip: GripStiffness
) -> dict[str, ParameterKey]:
    """Lists every key that may be overridden, with its unit and its value in these parameters."""
    return {
        key: ParameterKey(place.unit, place.value)
        for parameters in (racket, ball, grip)
        for key, place in _places_of(parameters).items()
    }


def overridden_numbers(
    names: Iterable[str],
    parts: Sequence[RacketParameters | BallParameters | GripStiffness],
    overrides: Mapping[str, Any],
) -> dict[str, float]:
    """Gives the numbers of keys, but single springs', as overrides leave them; not checked.

    Args:
        names: of the keys; one that the parts do not have is left out.
        parts: without the overrides.

    """
    places = {k: place for part in parts for k, place in _places_of(part).items()}

    def number_at(key: str) -> tuple[Any, ...]:  # a joint's number has two keys
        return key.split(".")[0], places[key].path, places[key].member

    set_to = {number_at(key): (key, x) for key, x in overrides.items() if key in places}
    found = {}
    for name in names:
        if name in places:
            key, value = set_to.get(number_at(name), (name, places[name].value))
            found[name] = finite_number(f"overrides.{key}", value, "a finite number")
    return found


def apply_overrides(parameters: P, overrides: Mapping[str, float], where: str = "overrides") -> P:
    """Gives a checked copy of a racket's, ball's or grip's parameters with the numbers of its keys.

    `overrides` has values in the units of their keys. Keys with another first word than theirs
    (racket, ball, grip) are left alone. The numbers'
    status becomes `inferred`, and their source tells what the file has.

    Raises:
        InputError: naming the key: it is unknown or names a number twice, its value is not a finite
            number, or the parameters are not valid with it.

    """
    prefix = _PREFIXES[type(parameters)] + "."
    mine = {key: value for key, value in overrides.items() if key.startswith(prefix)}
    if not mine:
        return parameters
    places = _places_of(parameters)
    check_known(mine, places, where)
    numbers = {
        k: finite_number(f"{where}.{k}", v, f"a finite number ({places[k].unit})")
        for k, v in mine.items()
    }
    _check_once(numbers, places, where)
    new = _with_numbers(parameters, numbers, places)
    bed = ("string_bed",)  # springs of their own change more of it than their k
    changed = {bed if key.startswith(SPRING) else places[key].path for key in mine}
    error = _error(new, changed)
    if error is not None:
        raise _blame(error, parameters, numbers, places, where)
    return new


def plain_overrides(
    overrides: Mapping[str, Any], keys: Mapping[str, ParameterKey]
) -> dict[str, Any]:
    """Gives the overrides with numbers in place of texts that have a unit, `170g`.

    What is no number with a unit stays, for `apply_overrides` to refuse.
    """

    def plain(key: str, value: Any) -> Any:
        if not isinstance(value, str) or key not in keys or as_number(value) is not None:
            return value
        try:
            return measure(key, value, keys[key].unit)
        except InputError:
            return value

    return {key: plain(key, value) for key, value in overrides.items()}


def check_known(overrides: Iterable[str], keys: Iterable[str], where: str = "overrides") -> None:
    """Raises InputError for the first key of `overrides` that `keys` does not have."""
    known = list(keys)
    for key in overrides:
        if key not in known:
            raise InputError(f"{where}.{key}", "an unknown key", _near(key, known))


def _near(key: str, known: list[str]) -> str:
    """The closest keys, or what may stand at the level where `key` leaves the known ones."""
    close = difflib.get_close_matches(key, known, n=3, cutoff=0.75)
    parts = key.split(".")
    for size in range(len(parts), -1, -1):
        stem = "".join(part + "." for part in parts[:size])
        below = dict.fromkeys(k[len(stem) :].split(".")[0] for k in known if k.startswith(stem))
        if size == len(parts) and below:
            break  # the name of a group: its members
        if close:
            return ", ".join(close)
        if below:
            break
    return f"{stem or 'a key that begins with '}{', '.join(below)}"


_KEPT = 32
_kept: OrderedDict[int, tuple[object, dict[str, _Place]]] = OrderedDict()
"""The places of the last parameters, by identity: a sweep asks for those of its files each case."""


def _places_of(parameters: RacketParameters | BallParameters | GripStiffness) -> dict[str, _Place]:
    found = _kept.get(id(parameters))
    if found is None or found[0] is not parameters:
        found = (parameters, _places(parameters))
        _kept[id(parameters)] = found
        while len(_kept) > _KEPT:
            _kept.popitem(last=False)
    return found[1]


def _places(parameters: RacketParameters | BallParameters | GripStiffness) -> dict[str, _Place]:
    """The keys of one parameter object, in the order of its file."""
    prefix = _PREFIXES[type(parameters)]
    places: dict[str, _Place] = {}
    for name, found in sourced_fields(parameters, idle=True):
        key, path = f"{prefix}.{name}", tuple(name.split("."))
        if key in _LABELS:
            continue
        if isinstance(found, Quantity):
            places[key] = _Place(path, None, found.unit, found.value)
        elif isinstance(found, Quantities):
            member = _MEMBERS.get(path[-1], "xyz".__getitem__)
            for i, value in enumerate(found.value):
                places[f"{key}.{member(i)}"] = _Place(path, i, found.unit, value)
    if isinstance(parameters, RacketParameters):
        for plane, label in parameters.throat_joint.labels().items():
            for what in ("stiffness", "damping"):
                printed = places[f"racket.throat_joint.{what}_{label}"]
                places[f"racket.throat_joint.{plane}_{what}"] = printed
        names = parameters.bed_topology().names
        stiffness = zip(names, _spring_stiffness(parameters), strict=True)
        for i, (name, k) in enumerate(stiffness):
            places[SPRING + name] = _Place(("string_bed", "stiffness"), i, "N/m", k)
    return places


def _spring_stiffness(racket: RacketParameters) -> list[float]:
    """Stiffness (N/m) of the springs, in the order of the topology's names."""
    bed = racket.string_bed
    stiffness = []
    for name in racket.bed_topology().names:
        formula = spring_formula(bed.springs.value[name])
        assert formula is not None  # the parameters have been checked
        k, p = formula
        factor = bed.rim_factors.value[p] if p >= 0 else 1.0
        stiffness.append(bed.stiffness.value[k] * factor)
    return stiffness


def _check_once(numbers: Mapping[str, float], places: Mapping[str, _Place], where: str) -> None:
    """A number of the throat joint has a label and a name: not both."""
    seen: dict[tuple[tuple[str, ...], int | None], str] = {}
    for key in numbers:
        if key.startswith(SPRING):
            continue
        first = seen.setdefault((places[key].path, places[key].member), key)
        if first != key:
            raise InputError(
                f"{where}.{key}", numbers[key], f"one key for one number ({first} sets it as well)"
            )


def _with_numbers(parameters: P, numbers: Mapping[str, float], places: Mapping[str, _Place]) -> P:
    new: Any = parameters
    springs = {k: v for k, v in numbers.items() if k.startswith(SPRING)}
    for key, number in numbers.items():
        if key not in springs:
            new = _with_number(new, places[key].path, key, places[key], number)
    if springs:
        new = _with_own_springs(new)
        for key, number in springs.items():
            place = places[key]
            current = new.string_bed.stiffness.value[place.member]
            place = dataclasses.replace(place, value=current)
            new = _with_number(new, place.path, key, place, number)
    return cast(P, new)


def _with_number(item: Any, path: tuple[str, ...], key: str, place: _Place, number: float) -> Any:
    """A copy of `item` with the number at `path` below it."""
    if path:
        below = _with_number(getattr(item, path[0]), path[1:], key, place, number)
        return dataclasses.replace(item, **{path[0]: below})
    note = f"set by the scenario's overrides; the file has {place.value:.10g}"
    if place.member is None:
        return Quantity(number, item.unit, "inferred", note)
    values = list(item.value)
    values[place.member] = number
    source = f"{key.rsplit('.', 1)[1]} {note}; the rest: {item.source}"
    return Quantities(tuple(values), item.unit, "inferred", source)


def _with_own_springs(racket: RacketParameters) -> RacketParameters:
    """The same string-bed with stiffnesses k1, k2, ..., one a spring, and no rim factors."""
    bed = racket.string_bed
    stiffness = Quantities(
        tuple(_spring_stiffness(racket)),
        bed.stiffness.unit,
        bed.stiffness.status,
        f"by spring, from: {bed.stiffness.source}",
    )
    springs = Assignment(
        {name: f"k{i}" for i, name in enumerate(racket.bed_topology().names, 1)},
        bed.springs.status,
        f"by spring, from: {bed.springs.source}",
    )
    factors = dataclasses.replace(bed.rim_factors, value=())
    new = dataclasses.replace(bed, stiffness=stiffness, rim_factors=factors, springs=springs)
    return dataclasses.replace(racket, string_bed=new)


def _error(
    parameters: RacketParameters | BallParameters | GripStiffness,
    changed: Iterable[tuple[str, ...]] | None,
) -> InputError | None:
    kind = type(parameters)
    try:
        _CHECKS[kind](parameters, _PREFIXES[kind], changed)
    except InputError as error:
        return error
    return None


def _blame(
    error: InputError,
    parameters: P,
    numbers: Mapping[str, float],
    places: Mapping[str, _Place],
    where: str,
) -> InputError:
    """The check's error, named after the keys without which it would not be."""
    guilty = []
    for key in numbers:
        rest = {k: v for k, v in numbers.items() if k != key}
        other = _error(_with_numbers(parameters, rest, places), None)
        if other is None or other.key != error.key:
            guilty.append(key)
    guilty = guilty or list(numbers)
    values: Any = [numbers[key] for key in guilty]
    value = values[0] if len(values) == 1 else values
    allowed = error.allowed
    if error.value != value:
        allowed += f" (with it {error.key} is {error.value})"
    return InputError(f"{where}.{f', {where}.'.join(guilty)}", value, allowed)
