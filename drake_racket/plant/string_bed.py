"""Gives a racket's string-bed to the StringBed system: its numbers, and where they are."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_racket.laws.bed import rest_lengths, spring_formula
from drake_racket.parameters.frame import FrameJoint
from drake_racket.parameters.racket import RacketParameters
from drake_racket.parameters.segments import segment_at
from drake_racket.plant.racket import Racket
from drake_racket.plant.systems.string_bed import StringBedModel, StringCoordinates


def string_bed_model(parameters: RacketParameters) -> StringBedModel:
    """Gives the numbers of a parameter file's string-bed to the StringBed system."""
    bed = parameters.string_bed
    topology = parameters.bed_topology()
    formulas = [spring_formula(bed.springs.value[name]) for name in topology.names]
    pairs = [pair for pair in formulas if pair is not None]
    bending = rim_bending(parameters)
    return StringBedModel(
        topology=topology,
        stiffness=np.array(bed.stiffness.value),
        rim_factors=np.array(bed.rim_factors.value),
        stiffness_index=np.array([k for k, _ in pairs]),
        rim_factor_index=np.array([p for _, p in pairs]),
        initial_tension=bed.initial_tension.value,
        damping=bed.damping.value,
        lengths=rest_lengths(
            topology, bed.spacing.value, bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
        ),
        arms=bending.arms,
        folds=bending.folds,
    )


@dataclass(frozen=True)
class RimBending:
    """The rim's bending says how the frame's joints move the rim that springs end on.

    Seen from the head's plane, a place of the rim at x, y beyond a joint at x_j rises by
    -(x - x_j) q of a joint about y and by y q of one about x, and comes nearer by half of
    (x - x_j) q^2 along x and of |y| q^2 along y; before the joint the angles count reversed. Angles
    are small: rises are linear in them and approaches quadratic (`_nearer`), which keeps energy and
    momentum exact. What joints about z do to the springs is left out: strings act across their
    plane alone. Of two segments the whole rim is the head's, as in Glynn et al. 2011.

    Attributes:
        arms: (m, j) rate of a spring's height dz per joint angle (m/rad).
        folds: (m, j, j) F of `laws.strings` (m^2).
        joints: numbers of the j joints, among `RacketParameters.frame_joints`.

    """

    arms: NDArray[np.float64]
    folds: NDArray[np.float64]
    joints: list[int]


def rim_bending(parameters: RacketParameters) -> RimBending:
    """Gives the rim's bending; without joints where no spring ends beyond one."""
    bed, topology = parameters.string_bed, parameters.bed_topology()
    segments, joints = parameters.frame_segments(), parameters.frame_joints()
    springs = len(topology.names)
    if len(segments) == 2:
        return RimBending(np.zeros((springs, 0)), np.zeros((springs, 0, 0)), [])
    head = [segment.name for segment in segments].index("head")
    arms = np.zeros((springs, len(joints)))
    folds = np.zeros((springs, len(joints), len(joints)))
    lengths = rest_lengths(
        topology, bed.spacing.value, bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
    )
    for row in np.flatnonzero(topology.second < 0):
        place = bed.spacing.value * topology.places[topology.first[row]]
        along = topology.directions[row]
        x, y = place + lengths[row] * along
        x += parameters.centre()[0]
        end = segment_at(segments, x)
        between = range(min(head, end), max(head, end))
        own = [i for i, j in enumerate(joints) if j.inner in between and j.axis in "xy"]
        for i in own:
            rise = -(x - joints[i].place) if joints[i].axis == "y" else y
            arms[row, i] = -rise if end > head else rise
        for i, j in itertools.product(own, own):
            nearer = _nearer(joints[i], joints[j], (x, y), along, outward=end > head)
            folds[row, i, j] = lengths[row] * nearer
    used = np.flatnonzero(np.any(arms != 0.0, axis=0))
    return RimBending(arms[:, used], folds[:, used][:, :, used], used.tolist())


def _nearer(
    one: FrameJoint,
    other: FrameJoint,
    place: tuple[float, float],
    along: NDArray[np.float64],
    *,
    outward: bool,
) -> float:
    """The second derivative (m) by two joint angles of how much nearer a place of the rim comes.

    Along a spring's direction. Turns about y bring it nearer along x by its distance from them,
    turns about x along y; and a turn about one axis acts on the height that turns about the other
    have given, those that are farther from the head first. Of one joint outward x comes before y.
    """
    x, y = place
    if one.axis == other.axis:
        if one.axis != ("y" if along[0] else "x"):
            return 0.0
        arms = (abs(x - one.place), abs(x - other.place)) if along[0] else (abs(y),)
        return min(arms)
    about_x, about_y = (one, other) if one.axis == "x" else (other, one)
    farther = (about_x.inner - about_y.inner) * (1 if outward else -1)
    x_first = farther > 0 or (farther == 0 and outward)
    if along[0]:
        return float(-along[0] * y) if x_first else 0.0
    return 0.0 if x_first else float(-along[1] * (x - about_y.place))


def string_coordinates(racket: Racket) -> StringCoordinates:
    """Tells where the string joints sit in the finalized plant's state."""
    plant = racket.plant
    bending = rim_bending(racket.parameters)
    joints = [*racket.string_joints, *(racket.frame_joints[i] for i in bending.joints)]
    return StringCoordinates(
        positions=np.array([j.position_start() for j in joints]),
        velocities=np.array([j.velocity_start() for j in joints]),
        num_positions=plant.num_positions(),
        num_velocities=plant.num_velocities(),
    )
