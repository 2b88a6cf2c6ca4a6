"""Makes a racket's parameters of a shop's numbers, each with its status, source and spread."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from drake_racket.io.errors import InputError
from drake_racket.parameters.frame import Part, ThroatJoint
from drake_racket.parameters.quantities import Quantity, Spread
from drake_racket.parameters.racket import (
    RACKETS,
    Landmarks,
    RacketParameters,
    check_racket,
    load_racket,
)
from drake_racket.parameters.specs import recipe, regressions
from drake_racket.parameters.specs.given import PRINTED, USUAL_LENGTH, Given, Specs, read_specs
from drake_racket.parameters.string_bed import StringBedParameters

STRINGS = 0.0155  # kg, of a strung racket: what shops take for strings
ASPECT = 4.0 / 3.0  # length over width of the rim
RIM_EDGE = 0.011  # m, from the rim ellipse to the tip
_PAPER = "mean of the two published rackets (Glynn et al. 2011, Table 1)"
_AMBIGUOUS = "one of many splits with the same mass, balance and swingweight"
WHOLE = (
    "Whole-racket results (ball speed, restitution, the racket's motion, fundamentals) are safe."
)
HINGE = (
    "Loads in the throat joint and the parts' own masses are not: the split of the racket into"
    " handle and head is one of many that have these numbers."
)


def racket_from_specs(
    name: str,
    *,
    mass: Given,
    balance: Given,
    swingweight: Given,
    head: Given,
    twistweight: Given = None,
    ra: Given = None,
    frequency: Given = None,
    length: Given = None,
    tension: Given = None,
    pattern: str | None = None,
    title: str = "",
    bed: str = "",
) -> RacketParameters:
    """Makes a racket of what a shop prints of it, strung; `recipe` has the equations.

    Numbers are in SI, or text with a unit: `"320g"`, `"33cm"`, `"98in2"`; text without one is in
    kg cm^2 for `swingweight` and `twistweight`, Hz for `frequency`, N for `tension`.

    Args:
        name: letters, digits and _.  head: area.
        twistweight: guessed of the other numbers if None, with a spread of 1.07 kg cm^2.
        ra, frequency: one or both; with neither the median of 1,337 rackets is taken.
        length: 27 in if None.
        tension: `low`, `high`, or of stringing; that of the published racket if None.
        pattern: mains x crosses, `16x19`: scales the strings' mass with their length.
        title: what pictures and reports call the racket.
        bed: `tour` or `recreational`, whose strings are taken; `tour` if empty, so that rackets
            that are compared are strung alike.

    Raises:
        InputError: a number that is not possible, or numbers that do not fit together.

    """
    given = {
        "mass": mass,
        "balance": balance,
        "swingweight": swingweight,
        "twistweight": twistweight,
        "head": head,
        "length": length,
        "ra": ra,
        "frequency": frequency,
    }
    specs = read_specs(name, given, title=title, tension=tension, pattern=pattern, bed=bed)
    return build(specs)


def build(specs: Specs, where: str = "") -> RacketParameters:
    """Makes the racket of checked specs; raises InputError where they do not fit together."""
    base = load_racket(specs.bed or RACKETS[0], specs.tension)
    length = specs.get("length") or USUAL_LENGTH
    if specs["balance"] >= length:
        got, most = f"{1e2 * specs['balance']:.4g} cm", f"{1e2 * length:.4g} cm"
        raise InputError(f"{where}balance", got, f"less than the racket's length, {most}")
    head_length = length - recipe.USUAL.joint * length
    bed = _string_bed(base.string_bed, specs, head_length)
    racket = dataclasses.replace(
        base,
        name=specs.name,
        title=specs.title,
        string_bed=bed,
        landmarks=_landmarks(base, recipe.USUAL.joint * length),
        specs=_whole(specs, length, where),
        notes=(WHOLE, HINGE, _bed_note(base), *_second_opinion(specs)),
    )
    racket = with_specs(racket, {}, where)
    check_racket(racket, where.rstrip(", ") or specs.name)
    return racket


def with_specs(
    racket: RacketParameters,
    changes: Mapping[str, float],
    where: str = "",
    proportions: recipe.Proportions = recipe.USUAL,
) -> RacketParameters:
    """Solves the frame of a racket's `specs` anew, some of them changed; its strings stay.

    Added masses are not added again: see `added_mass.readded`.

    Args:
        racket: with `specs`.  changes: by name of the specs, SI.
        proportions: of the two parts, instead of the usual ones.

    Raises:
        InputError: the numbers do not fit together.

    """
    value = {key: spread.value for key, spread in racket.specs.items()} | dict(changes)
    bed, joint = racket.string_bed, recipe.USUAL.joint * value["length"]
    places = bed.spacing.value * racket.bed_topology().places + [joint + bed.gsc.value, 0.0]
    whole = recipe.Whole(
        mass=value["mass"],
        balance=value["balance"],
        swingweight=value["swingweight"],
        twistweight=value["twistweight"],
        length=value["length"],
        out_of_plane=value["frequency"],
        in_plane=value["frequency"] * value["in_over_out"],
    )
    strings = recipe.Strings(bed.mass.value, np.asarray(places))
    found = recipe.split(whole, strings, bed.rim_semi_axis_y.value, where, proportions)
    return dataclasses.replace(
        racket,
        handle=_part(found.handle, "handle"),
        head=_part(found.head, "head"),
        throat_joint=_joint(racket, found),
    )


def _quantity(value: float, unit: str, status: str, source: str) -> Quantity:
    return Quantity(float(f"{value:.12g}"), unit, status, source)


def _whole(specs: Specs, length: float, where: str) -> dict[str, Spread]:
    """The whole racket's numbers, given or filled in, with their standard deviations."""
    shop = "printed by the shop, strung"
    found = {
        key: Spread(value, PRINTED[key].unit, "measured", shop, PRINTED[key].spread)
        for key, value in specs.values.items()
        if key not in ("frequency", "length")
    }
    usual = "no length given: the usual 27 in"
    source, status = (shop, "measured") if specs.get("length") else (usual, "inferred")
    found["length"] = Spread(length, "m", status, source)
    if "twistweight" not in found:
        guess = regressions.guessed_twistweight(specs["head"], specs["mass"], specs["swingweight"])
        source = (
            "not given; guessed: .180 A[in2] + .0046 m[g] + .034 SW[kg cm2] - 16.3,"
            f" sd 1.07 kg cm2: {regressions.SOURCE}"
        )
        found["twistweight"] = Spread(guess.value, "kg*m^2", "inferred", source, guess.sd)
    f = recipe.fundamental(specs["mass"], specs.get("ra"), specs.get("frequency"), where)
    found["frequency"] = Spread(f.value, "Hz", f.status, f.source, f.sd)
    found["in_over_out"] = Spread(
        regressions.IN_OVER_OUT,
        "1",
        "inferred",
        "in-plane over out-of-plane fundamental of two rackets (Glynn et al. 2011, Results)",
        regressions.IN_OVER_OUT * regressions.IN_OVER_OUT_SPREAD,
    )
    return found


def _part(rigid: recipe.Rigid, name: str) -> Part:
    handle = name == "handle"
    radius = recipe.USUAL.handle_radius if handle else recipe.USUAL.head_radius
    joint = f"throat joint at {recipe.USUAL.joint} of the length, {_PAPER}"
    swing = f"root of the swingweight equation; {_AMBIGUOUS}"
    rest = f"what mass and strings leave beside the head; {_AMBIGUOUS}"
    com = (
        f"of the balance; {_AMBIGUOUS}"
        if handle
        else f"{recipe.USUAL.head_com} of the head's length, {_PAPER}"
    )
    roll = (
        f"radius of gyration {1e3 * recipe.HANDLE_ROLL_RADIUS:g} mm, {_PAPER}"
        if handle
        else "of the twistweight, less handle and strings"
    )
    across = f"radius of gyration {radius:.3f} of the part's length, {_PAPER}"
    normal = "that of the transverse axis (slender)" if handle else "flat: sum of the other two"
    longitudinal = _quantity(rigid.longitudinal, "kg*m^2", "inferred", roll)
    transverse = _quantity(rigid.transverse, "kg*m^2", "inferred", across)
    # a flat head's is the sum, to the last bit
    frontal = rigid.transverse if handle else longitudinal.value + transverse.value
    return Part(
        mass=_quantity(rigid.mass, "kg", "inferred", rest if handle else swing),
        length=_quantity(rigid.length, "m", "inferred", joint if handle else f"the rest; {joint}"),
        com=_quantity(rigid.com, "m", "inferred", com),
        moi_longitudinal=longitudinal,
        moi_frontal=Quantity(frontal, "kg*m^2", "inferred", normal),
        moi_transverse=transverse,
    )


def _joint(racket: RacketParameters, found: recipe.Split) -> ThroatJoint:
    """Stiffness of the fundamentals; damping keeps the published rackets' time constants."""
    specs, old = racket.specs, racket.throat_joint
    out, ratio = specs["frequency"], specs["in_over_out"]
    share = 2.0 * out.sd / out.value
    in_share = 2.0 * math.hypot(out.sd / out.value, ratio.sd / ratio.value)
    known = "calculated" if out.status == "measured" else "inferred"
    text = "J (2 pi f)^2, J the bending inertia of the two parts"
    labels = {label: plane for plane, label in old.labels().items()}
    plane = {
        "out_of_plane": (found.out_of_plane, known, f"{text}; f: {out.source}", share),
        "in_plane": (
            found.in_plane,
            "inferred",
            f"{text}; f: {ratio.value:g} of the out-of-plane one, {ratio.source}",
            in_share,
        ),
    }
    values: dict[str, Any] = {"reading": old.reading}
    for label, name in labels.items():
        stiffness, status, source, spread = plane[name]
        old_stiffness, old_damping = old.constants(name)
        values[f"stiffness_{label}"] = _quantity(
            stiffness, "N*m/rad", status, f"{source}; sd {100 * spread:.2g} %"
        )
        values[f"damping_{label}"] = _quantity(
            old_damping * stiffness / old_stiffness,
            "N*m*s/rad",
            "inferred",
            "damping over stiffness as in the published racket (Glynn et al. 2011, Table 2)",
        )
    return ThroatJoint(**values)


def _landmarks(base: RacketParameters, joint: float) -> Landmarks:
    place = base.landmarks.accelerometer
    if place.value <= joint:
        return base.landmarks
    source = f"{place.source}; at most the handle's length"
    return dataclasses.replace(
        base.landmarks, accelerometer=_quantity(joint, "m", "inferred", source)
    )


def _string_bed(base: StringBedParameters, specs: Specs, head_length: float) -> StringBedParameters:
    """The published racket's springs on a rim of the head's area."""
    area = specs["head"]
    half_length = math.sqrt(area * ASPECT / math.pi)
    half_width = half_length / ASPECT
    given = f"ellipse of a head of {area / regressions.SQUARE_INCH:.4g} in2"
    rim = f"{given}, as long as {ASPECT:.3f} of its width (as the published rackets)"
    mass, source = _string_mass(specs, half_length, half_width)
    return dataclasses.replace(
        base,
        gsc=_quantity(
            head_length - RIM_EDGE - half_length,
            "m",
            "inferred",
            f"centre of the rim ellipse, {1e3 * RIM_EDGE:g} mm from the tip",
        ),
        mass=_quantity(mass, "kg", "inferred", source),
        rim_semi_axis_x=_quantity(half_length, "m", "inferred", rim),
        rim_semi_axis_y=_quantity(half_width, "m", "inferred", rim),
    )


def _string_mass(specs: Specs, a: float, b: float) -> tuple[float, str]:
    usual = f"{1e3 * STRINGS:g} g, what shops take for the strings of a racket"
    if specs.pattern is None:
        return STRINGS, usual
    # strings evenly over an ellipse are pi/4 of its axis long on the average
    mains, crosses = specs.pattern
    a98 = math.sqrt(98.0 * regressions.SQUARE_INCH * ASPECT / math.pi)
    mass = STRINGS * (mains * a + crosses * b) / (16 * a98 + 19 * a98 / ASPECT)
    text = f"pattern {mains}x{crosses}, by the strings' length from {usual}, 16x19 in 98 in2"
    return mass, text


def _bed_note(base: RacketParameters) -> str:
    return (
        f"Springs, friction and damping are those of {base.title}: a shop prints nothing that"
        " tells them."
    )


def _second_opinion(specs: Specs) -> list[str]:
    """What the flex alone tells of the joint's stiffness, without the split."""
    ra = specs.get("ra")
    if ra is None:
        return []
    found = regressions.stiffness_of_ra(ra)
    return [
        f"The flex alone, by kf = 0.378 RA^1.93, gives {found.value:.0f} N m/rad"
        f" (sd {100 * regressions.STIFFNESS_SPREAD:g} %) for out-of-plane bending: a check of the"
        " split, and not used."
    ]
