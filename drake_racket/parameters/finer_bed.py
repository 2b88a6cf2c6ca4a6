"""Makes a bed of more masses of a bed of nine, with the same mass, rim and frame.

The lines of the finer grid lie between the outermost lines of the given one, so that its nine
points are points of the finer bed as well. Each line carries its share of the tension and of the
stiffness, by number: with n lines for 3, a spring of the rest length L has

    T0' = tau T0 3 / n,        k' = sigma (3 / n) EA / L,

EA = k L (N) of the given bed's spring at that place, on a straight line between its lines. tau and
sigma are 1 or what `rigs.finer_beds` calibrates them to.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError
from drake_racket.laws.bed import MOST, BedTopology, grid_topology, rest_lengths, spring_formula
from drake_racket.parameters.quantities import Assignment, Quantities, Quantity
from drake_racket.parameters.racket import RacketParameters, check_racket

Array = NDArray[np.float64]

_PLACES = np.array([1.0, 0.0, -1.0])
"""Of the given bed's three lines, in its spacings: columns along y, rows along x."""


def finer_bed(
    racket: RacketParameters, lines: int, *, tension: float = 1.0, stiffness: float = 1.0
) -> RacketParameters:
    """Gives the racket with lines x lines masses in its bed.

    Args:
        racket: with a bed of 3 x 3.
        lines: odd, so that the given points stay points: 3, 5, 7, ...
        tension, stiffness: the factors tau and sigma.

    Raises:
        InputError: another bed, a number of lines that is not odd or too large, or factors that are
            not above 0.

    """
    bed = racket.string_bed
    if (bed.columns, bed.rows) != (3, 3):
        raise InputError("finer_bed: racket", f"{bed.columns} x {bed.rows} masses", "3 x 3 masses")
    if lines not in range(3, MOST + 1, 2) or (lines - 1) % 2:
        raise InputError("finer_bed: lines", lines, f"an odd number from 3 to {MOST}")
    for key, factor in (("tension", tension), ("stiffness", stiffness)):
        if not 0.0 < factor < 100.0:
            raise InputError(f"finer_bed: {key}", factor, "above 0, below 100")
    topology = grid_topology(lines, lines)
    spacing = 2.0 * bed.spacing.value / (lines - 1)
    k = stiffness * 3.0 / lines * _axial_stiffness(racket, topology)
    k /= rest_lengths(topology, spacing, bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value)
    source = f"{lines} x {lines} masses of the bed of {racket.name}; tau {tension:g}, sigma"
    source = f"{source} {stiffness:g}; its file: "
    names = {name: f"k{i}" for i, name in enumerate(topology.names, 1)}
    t0 = tension * 3.0 / lines * bed.initial_tension.value
    new = dataclasses.replace(
        bed,
        spacing=_calculated(bed.spacing, spacing, source),
        initial_tension=_calculated(bed.initial_tension, t0, source),
        stiffness=Quantities(tuple(k), "N/m", "calculated", source + bed.stiffness.source),
        rim_factors=dataclasses.replace(bed.rim_factors, value=()),
        springs=Assignment(names, "calculated", source + bed.springs.source),
        columns=lines,
        rows=lines,
    )
    friction = dataclasses.replace(racket.friction, points=_friction(racket, topology, source))
    made = dataclasses.replace(racket, string_bed=new, friction=friction)
    check_racket(made, "finer_bed")
    return made


def _calculated(quantity: Quantity, value: float, source: str) -> Quantity:
    return Quantity(value, quantity.unit, "calculated", source + quantity.source)


def _axial_stiffness(racket: RacketParameters, topology: BedTopology) -> Array:
    """EA (N) of the given bed at the springs of the finer one, (m,)."""
    bed, own = racket.string_bed, racket.bed_topology()
    lengths = rest_lengths(
        own, bed.spacing.value, bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
    )
    axial = {}
    for name, length in zip(own.names, lengths, strict=True):
        formula = spring_formula(bed.springs.value[name])
        assert formula is not None  # the parameters have been checked
        k, p = formula
        factor = bed.rim_factors.value[p] if p >= 0 else 1.0
        axial[name] = bed.stiffness.value[k] * factor * length
    found = np.empty(len(topology.names))
    half = (topology.rows - 1) / 2.0
    for i, (first, direction) in enumerate(zip(topology.first, topology.directions, strict=True)):
        place = topology.places[first] / half  # x, y in spacings of the given bed
        along = 0 if direction[0] else 1  # mains run along x
        rim = topology.second[i] < 0
        if not rim:  # the middle of the spring
            place = 0.5 * (place + topology.places[topology.second[i]] / half)
        values = [axial[_spring(line, along, float(place[along]), bool(rim))] for line in range(3)]
        # lines of the given bed, from +1 to -1
        found[i] = np.interp(-place[1 - along], -_PLACES, values)
    return found


def _spring(line: int, along: int, place: float, rim: bool) -> str:
    """The given bed's spring on one of its lines, at a place along it (spacings)."""
    if along == 0:  # mains: line is the column, from +y; places from the tip
        column = line + 1
        if rim:
            return f"tip-{column}" if place > 0.0 else f"throat-{column + 6}"
        return f"{column}-{column + 3}" if place > 0.0 else f"{column + 3}-{column + 6}"
    row = 3 * line  # crosses: line is the row, from the tip; places from the left
    if rim:
        return f"left-{row + 1}" if place > 0.0 else f"right-{row + 3}"
    return f"{row + 1}-{row + 2}" if place > 0.0 else f"{row + 2}-{row + 3}"


def _friction(racket: RacketParameters, topology: BedTopology, source: str) -> Assignment:
    """The nearest given point's coefficient at each point."""
    half, own = (topology.rows - 1) / 2.0, racket.bed_topology().places
    points = {}
    for number, place in zip(topology.points, topology.places, strict=True):
        nearest = int(np.argmin(np.sum((own - place / half) ** 2, axis=1))) + 1
        points[str(number)] = racket.friction.points.value[str(nearest)]
    return Assignment(points, "calculated", source + racket.friction.points.source)
