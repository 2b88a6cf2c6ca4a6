"""Says where each number of a compiled model stands: columns of its tables.

A model is two flat vectors, one of integers (what hangs where) and one of floats (masses, lengths,
constants). A table is a block of one of them, seen as rows; `Tables` lists the blocks in order. One
vector of floats is one case: a batch of cases shares the integers.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

# ---- kinds of nodes: one for each degree of freedom, or for a body that is free in the world
REVOLUTE, PRISMATIC, SCREW, SPIN, QUATERNION, RPY, WELD, FREE_QUATERNION, FREE_RPY = range(9)
"""REVOLUTE, PRISMATIC, SCREW: about or along an axis of the frame F on the parent. SPIN: rotation
about an axis of F that F carries; the third spin of a ball joint is QUATERNION or RPY and has the
rotation. WELD: none, kept since its load is asked for. FREE_*: six, of a body free in the world."""

# ---- nodes, integers
PARENT, CARRIER, KIND, AXIS, Q, V, TURNED = range(7)
NODE_INTS = 7
"""PARENT: the node inboard, -1 for the world. CARRIER: the node that the axis moves with. AXIS: 0
to 2, of F. Q, V: where its coordinates and velocities begin in q and in v. TURNED: 1 if F is turned
on the parent, 0 if it has the parent's axes."""

# ---- nodes, floats
R_PF, P_PF, MASS, COM, MOMENTS, PITCH, DAMPING, SPRING, NOMINAL, ROTOR, WEIGHT, RUN = (
    0,
    9,
    12,
    13,
    16,
    22,
    23,
    29,
    30,
    31,
    32,
    36,
)
NODE_FLOATS = 37
"""Pose of F in the parent (9 + 3); mass, mass centre (3) and moments xx, yy, zz, xy, xz, yz about
the node's origin (6); pitch (m/rad); damping (6 of a free node, else 1); spring, its nominal place;
rotor; mass that gravity pulls, and its first moments (4); RUN: the number of nodes that are taken
together from this one on, turning about axes through one point with nothing between them; 0 if it
is one of them, behind the first."""

# ---- nodes, work
ROT, POS, SUB, VEL, BIAS, ART, FORCE, GAIN, PIVOT, DRIVE, ACC, OWN = (
    0,
    9,
    12,
    18,
    24,
    30,
    51,
    57,
    63,
    64,
    65,
    71,
)
NODE_WORK = 77
"""Rotation (9) and place (3) in the world; motion subspace, velocity, bias (6 each); articulated
inertia (21); bias force (6); U = I S (6), D, u; acceleration (6); force that acts on the node from
outside (6). Spatial vectors are about one point, rotational part first, in the world's axes."""

# ---- point masses on prismatic joints: the strings
LEAF_INTS = 3  # PARENT, and
LEAF_Q, LEAF_V = 1, 2
LEAF_PLACE, LEAF_AXIS, LEAF_MASS, LEAF_WEIGHT, LEAF_DAMPING = 0, 3, 6, 7, 8
LEAF_FLOATS = 9
PUSH, PULL, DRAG, RATE = 9, 12, 13, 16
LEAF_WORK = 17
"""Place (3) and axis (3) in the world, velocity (3), outside force (3), force along the axis, what
the motion at v' = 0 leaves of the outside force (3), and rate along the axis."""

# ---- bushings
BUSHING_INTS = 2  # nodes of A and of C
R_NA, P_NA, R_NC, P_NC, TORQUE_K, TORQUE_D, FORCE_K, FORCE_D = 0, 9, 12, 21, 24, 27, 30, 33
BUSHING_FLOATS = 36

# ---- contacts
LEAF_0, POINTS, BALL, MIDDLE, GRID_0, ELEMENT = range(6)
CONTACT_INTS = 6
"""First leaf and number of points of the bed; the ball's node; the point nearest the centre
(from 1); where its points begin in the table of points; where the element of contact surface begins
in the state y, -1 for the paper's contact, which has none."""
BALL_LAW, SCALES, CHOICES, RIM, R_HS, P_BALL, SURFACE = 0, 8, 10, 13, 15, 24, 27
CONTACT_FLOATS = 32
"""Parameters of the BallContact; rim (2); axes of the strings in the head's node (9); the ball's
centre in its node (3); R, chi, kt, ct and alone of contact surface (5)."""
POINT_FLOATS = 3
"""Place x, y of a point in the head's axes, and mu."""

# ---- limits of joints
LIMIT_INTS, LIMIT_FLOATS = 2, 4

# ---- losses of frame and limb: place in v; damping
LOSS_INTS, LOSS_FLOATS = 1, 1

# ---- what the rim's bending does to springs that end on it, by springs; see `laws.strings`
RIM_INTS, FOLD_INTS = 3, 5
"""Spring; places in q and in v of one joint of the frame, or of two. The float is a number of B
(m/rad) or of F (m^2)."""

# ---- what strikes a node: a force of laws.pulse, at a place of the node and along its axes
STRIKE_INTS, STRIKE_FLOATS = 2, 6
"""Node; 1 if the pulse is sampled. Place (3), direction (3). One at most; its numbers follow."""

HEADER = 18
"""Integers before the tables: numbers of nodes, leaves, bushings, springs, contacts, points,
limits, frame losses, limb losses, positions, velocities; the bushings of the grip and of the hand's
wrist, or -1; numbers of the rim's arms and folds; of the elements, which stand in the state y
behind q and v; of strikes, and of the numbers of their pulse."""
(
    NODES,
    LEAVES,
    BUSHINGS,
    SPRINGS,
    CONTACTS,
    ALL_POINTS,
    LIMITS,
    FRAME_LOSSES,
    LIMB_LOSSES,
    POSITIONS,
    VELOCITIES,
    GRIP_BUSHING,
    WRIST_BUSHING,
    RIMS,
    FOLDS,
    ELEMENTS,
    STRIKES,
    PULSE,
) = range(HEADER)

GLOBALS, BEGIN = 4, 3
"""Floats before the tables: gravity (3); the time (s) of a pulse at the begin of a run."""

CLOCK, STEP_CLOCK, ORIGIN_WORK = 3, 4, 5
"""Work beside the fixed point (3): the time (s) of the state whose rates are wanted, and of the
begin of the step. A strike alone looks at the time."""


(
    NODE_ROWS,
    LEAF_ROWS,
    BUSHING_ENDS,
    SPRING_ENDS,
    CONTACT_ROWS,
    LIMIT_PLACES,
    FRAME_PLACES,
    LIMB_PLACES,
    RIM_ROWS,
    FOLD_ROWS,
    STRIKE_ROWS,
    NODE_NUMBERS,
    LEAF_NUMBERS,
    BUSHING_NUMBERS,
    SPRING_NUMBERS,
    CONTACT_NUMBERS,
    POINT_NUMBERS,
    LIMIT_NUMBERS,
    FRAME_DAMPING,
    LIMB_DAMPING,
    RIM_ARMS,
    FOLD_SIZES,
    STRIKE_NUMBERS,
    PULSE_NUMBERS,
    TORQUES,
    HEAD,
    GLOBAL,
) = range(27)
"""Places of the tables in what `open_model` returns."""


TABLES = (
    (0, NODES, NODE_INTS),
    (0, LEAVES, LEAF_INTS),
    (0, BUSHINGS, BUSHING_INTS),
    (0, SPRINGS, -2),
    (0, CONTACTS, CONTACT_INTS),
    (0, LIMITS, LIMIT_INTS),
    (0, FRAME_LOSSES, 0),
    (0, LIMB_LOSSES, 0),
    (0, RIMS, RIM_INTS),
    (0, FOLDS, FOLD_INTS),
    (0, STRIKES, STRIKE_INTS),
    (1, NODES, NODE_FLOATS),
    (1, LEAVES, LEAF_FLOATS),
    (1, BUSHINGS, BUSHING_FLOATS),
    (1, SPRINGS, -4),
    (1, CONTACTS, CONTACT_FLOATS),
    (1, ALL_POINTS, POINT_FLOATS),
    (1, LIMITS, LIMIT_FLOATS),
    (1, FRAME_LOSSES, 0),
    (1, LIMB_LOSSES, 0),
    (1, RIMS, 0),
    (1, FOLDS, 0),
    (1, STRIKES, STRIKE_FLOATS),
    (1, PULSE, 0),
    (1, VELOCITIES, 0),
)
"""Of integers (0) or floats (1): what is counted; columns, 0 for none, or minus the number of rows
where the columns are counted."""


def open_model(ints: Any, floats: Any) -> tuple[Any, ...]:
    """Gives the tables of a model as views of its two vectors: integers, floats, then heads.

    Floats may have further axes, as lanes of their derivatives do: so have their tables then.
    """
    tables, place = [], [HEADER, GLOBALS]
    for kind, counted, columns in TABLES:
        count = int(ints[counted])
        shape = (count, columns) if columns > 0 else (-columns, count) if columns else (count,)
        end = place[kind] + math.prod(shape)
        flat = (ints, floats)[kind]
        tables.append(flat[place[kind] : end].reshape(shape + flat.shape[1:]))
        place[kind] = end
    return (*tables, ints[:HEADER], floats[:GLOBALS])


def one_by_one(tables: tuple[Any, ...]) -> tuple[Any, ...]:
    """Gives the tables of a model whose axes are not taken together: each node has its motion."""
    nodes = tables[NODE_NUMBERS].copy()
    nodes[:, RUN] = 1.0
    return (*tables[:NODE_NUMBERS], nodes, *tables[NODE_NUMBERS + 1 :])


def work_of(ints: Any) -> tuple[Any, Any]:
    """Gives the work arrays of one evaluation: of nodes and of leaves."""
    return np.zeros((ints[NODES], NODE_WORK)), np.zeros((ints[LEAVES], LEAF_WORK))
