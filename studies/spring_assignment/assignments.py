"""Which string spring carries which of k1-k4 and p1-p6: every assignment, and how it plays.

The source (Glynn et al. 2011) prints the parameters (Table 3) and shows where they belong in a
figure that its text does not have. What remains are symmetries:

* Interior springs. The bed is the same left and right, and the source has no difference between
  tip and throat; with both, the 12 interior springs fall into exactly four groups, one per kind of
  line (`INTERIOR`), which is the number of k's.
* Rim springs. Left-right symmetry leaves seven groups (`RIM`), tip-throat symmetry besides it
  four; there are six p's. So one of the three pairs of mirror images (tip and throat) shares a p
  and two pairs do not: three groupings (`GROUPINGS`).

A rim spring has p times the k of its own line ("towards the rim proportional to those of the
centre"). Tip and throat look alike to a clamped head: the rim is an ellipse about the string-bed's
centre, and an assignment turned end for end has the same restitutions at mirrored points. One of
each such pair is enough: 24 x 360 assignments in each grouping.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_racket import InputError, RacketParameters, string_bed_model
from drake_racket.laws import grid_topology, spring_formula

INTERIOR: dict[str, tuple[str, ...]] = {
    "centre main": ("2-5", "5-8"),
    "side mains": ("1-4", "4-7", "3-6", "6-9"),
    "centre cross": ("4-5", "5-6"),
    "outer crosses": ("1-2", "2-3", "7-8", "8-9"),
}
"""Line -> its interior springs; the order of an assignment's k."""

RIM: dict[str, tuple[str, ...]] = {
    "centre main, throat": ("throat-8",),
    "centre main, tip": ("tip-2",),
    "side mains, throat": ("throat-7", "throat-9"),
    "side mains, tip": ("tip-1", "tip-3"),
    "centre cross": ("left-4", "right-6"),
    "outer cross, throat": ("left-7", "right-9"),
    "outer cross, tip": ("left-1", "right-3"),
}
"""Group of rim springs that left-right symmetry keeps together -> springs."""

_LINE = {"centre main": 0, "side mains": 1, "centre cross": 2, "outer cross": 3}

GROUPINGS: dict[str, tuple[tuple[int, ...], ...]] = {
    "outer crosses share": ((0,), (1,), (2,), (3,), (4,), (5, 6)),
    "side mains share": ((0,), (1,), (2, 3), (4,), (5,), (6,)),
    "centre main shares": ((0, 1), (2,), (3,), (4,), (5,), (6,)),
}
"""Which pair of tip and throat has one p -> the six classes, as positions in RIM."""


@dataclass(frozen=True)
class SpringAssignment:
    """One assignment.

    Attributes:
        grouping: one of GROUPINGS.
        k: (4,) 1-based number of the k of each of INTERIOR.
        p: (7,) 1-based number of the p of each of RIM; two share one.

    """

    grouping: str
    k: tuple[int, ...]
    p: tuple[int, ...]

    def springs(self) -> dict[str, str]:
        """Spring -> formula, as in a racket's file (`string_bed.springs`)."""
        found = {
            s: f"k{k}" for k, group in zip(self.k, INTERIOR.values(), strict=True) for s in group
        }
        for p, (name, group) in zip(self.p, RIM.items(), strict=True):
            line = _LINE[name.split(",")[0]]
            found |= dict.fromkeys(group, f"p{p}*k{self.k[line]}")
        return {name: found[name] for name in grid_topology().names}

    def mirrored(self) -> SpringAssignment:
        """Tip and throat exchanged."""
        a, b, c, d, e, f, g = self.p
        return SpringAssignment(self.grouping, self.k, (b, a, d, c, e, g, f))

    def first_of_pair(self) -> SpringAssignment:
        """The one of it and its mirror image that `all_assignments` has."""
        return min(self, self.mirrored(), key=lambda a: a.p)

    def label(self) -> str:
        """In short: the k's in the order of INTERIOR, the p's in that of RIM."""
        return f"k {' '.join(map(str, self.k))}, p {' '.join(map(str, self.p))}"


def all_assignments(grouping: str) -> Iterator[SpringAssignment]:
    """Every assignment of a grouping, one of each pair of mirror images (8640).

    Raises:
        InputError: an unknown grouping.

    """
    if grouping not in GROUPINGS:
        raise InputError("grouping", grouping, ", ".join(GROUPINGS))
    classes = GROUPINGS[grouping]
    for k in itertools.permutations(range(1, 5)):
        for numbers in itertools.permutations(range(1, 7)):
            p = [0] * len(RIM)
            for number, members in zip(numbers, classes, strict=True):
                for i in members:
                    p[i] = number
            found = SpringAssignment(grouping, k, tuple(p))
            if found == found.first_of_pair():
                yield found


def assignment_of(racket: RacketParameters) -> SpringAssignment:
    """The assignment that a racket's file has.

    Raises:
        InputError: it is none of `GROUPINGS`.

    """
    springs = racket.string_bed.springs.value
    allowed = "an assignment of k1-k4 and p1-p6 that is in spring_assignment.GROUPINGS"
    parsed = {name: spring_formula(formula) for name, formula in springs.items()}
    k = tuple((parsed[g[0]] or (-1, -1))[0] + 1 for g in INTERIOR.values())
    p = tuple((parsed[g[0]] or (-1, -1))[1] + 1 for g in RIM.values())
    for grouping, classes in GROUPINGS.items():
        found = SpringAssignment(grouping, k, p)
        alike = all(len({p[i] for i in members}) == 1 for members in classes)
        if alike and sorted(k) == [1, 2, 3, 4] and sorted(set(p)) == [1, 2, 3, 4, 5, 6]:
            spelled = {name: formula.replace(" ", "") for name, formula in springs.items()}
            if found.springs() == spelled:
                return found
    raise InputError(f"{racket.name}: string_bed.springs", "another assignment", allowed)


def indices(assignment: SpringAssignment) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """0-based k and p of the 24 springs, (24,) each; p is -1 for none: `StringBedModel`."""
    pairs = [spring_formula(formula) for formula in assignment.springs().values()]
    known = [pair for pair in pairs if pair is not None]
    return np.array([k for k, _ in known]), np.array([p for _, p in known])


def geometric_factors(racket: RacketParameters) -> NDArray[np.float64]:
    """The p that each of RIM has if strings run on to the rim: interior over rim rest length.

    A spring stands for n strings side by side, k = n E A / L; a line's springs have the same n.
    """
    lengths = dict(zip(racket.bed_topology().names, string_bed_model(racket).lengths, strict=True))
    spacing = racket.string_bed.spacing.value
    return np.array([spacing / lengths[group[0]] for group in RIM.values()])
