"""The string-bed of a racket file has points, springs and friction; here are also their checks."""

from dataclasses import dataclass
from typing import Annotated

from drake_racket.io.errors import InputError
from drake_racket.io.schema import Schema, Whole
from drake_racket.laws.bed import FEWEST, MOST, BedTopology, spring_formula
from drake_racket.parameters.quantities import Assignment, Of, Quantities, Quantity


@dataclass(frozen=True)
class StringBedParameters(Schema):
    """Point masses and springs: `laws.bed` numbers and names them, `strings` has the law."""

    gsc: Annotated[Quantity, Of("m")]  # geometric string-bed centre, from the throat joint along x
    spacing: Annotated[Quantity, Of("m")]
    mass: Annotated[Quantity, Of("kg")]  # of all the strings
    rim_semi_axis_x: Annotated[Quantity, Of("m")]
    rim_semi_axis_y: Annotated[Quantity, Of("m")]
    stringing_tension: Annotated[Quantity, Of("N")]
    initial_tension: Annotated[Quantity, Of("N")]  # T0
    stiffness: Annotated[Quantities, Of("N/m")]  # k1, k2, ...
    rim_factors: Annotated[Quantities, Of("1", least=0)]  # p1, p2, ...
    damping: Annotated[Quantity, Of("N*s/m", sign="non-negative")]
    springs: Assignment  # spring -> "k4" or "p6*k4"
    columns: Annotated[int, Whole(FEWEST, MOST)] = 3  # of points, side by side
    rows: Annotated[int, Whole(FEWEST, MOST)] = 3  # of points, from tip to throat


@dataclass(frozen=True)
class FrictionParameters(Schema):
    """Sliding friction between ball and strings."""

    coefficients: Annotated[Quantities, Of("1", sign="non-negative")]  # mu1, mu2, ...
    points: Assignment  # point -> "mu1"


def check_springs(bed: StringBedParameters, topology: BedTopology, where: str) -> None:
    """Raises InputError unless every spring has a formula, and every parameter a spring."""
    key = f"{where}: string_bed.springs.value"
    counts = len(bed.stiffness.value), len(bed.rim_factors.value)
    used: set[str] = set()
    for name in bed.springs.value:
        if name not in topology.names:
            raise InputError(f"{key}.{name}", "an unknown spring", ", ".join(topology.names))
    for name in topology.names:
        if name not in bed.springs.value:
            allowed = f"all {len(topology.names)} springs must be assigned"
            raise InputError(f"{key}.{name}", "nothing", allowed)
        formula = bed.springs.value[name]
        parsed = spring_formula(formula)
        if parsed is None or parsed[0] >= counts[0] or parsed[1] >= counts[1]:
            raise InputError(
                f"{key}.{name}",
                formula,
                f"k1 to k{counts[0]}, or a rim factor p1 to p{counts[1]} times one: p6*k4",
            )
        used.update(formula.replace(" ", "").split("*"))
    for letter, count, field_name in zip("kp", counts, ("stiffness", "rim_factors"), strict=True):
        for i in range(1, count + 1):
            if f"{letter}{i}" not in used:
                raise InputError(
                    f"{where}: string_bed.{field_name}.value",
                    f"{count} numbers",
                    f"only parameters that a spring uses ({letter}{i} is used by none)",
                )


def check_friction(friction: FrictionParameters, topology: BedTopology, where: str) -> None:
    """Raises InputError unless every point has a coefficient, and every coefficient a point."""
    count = len(friction.coefficients.value)
    key = f"{where}: friction.points.value"
    names = [f"mu{i}" for i in range(1, count + 1)]
    for point in friction.points.value:
        if point not in [str(i) for i in topology.points]:
            raise InputError(f"{key}.{point}", "an unknown point", f"1 to {len(topology.points)}")
    for i in topology.points:
        name = friction.points.value.get(str(i), "nothing")
        if name not in names:
            raise InputError(f"{key}.{i}", name, ", ".join(names))
    for name in names:
        if name not in friction.points.value.values():
            raise InputError(
                f"{where}: friction.coefficients.value",
                f"{count} numbers",
                f"only coefficients that a point uses ({name} is used by none)",
            )
