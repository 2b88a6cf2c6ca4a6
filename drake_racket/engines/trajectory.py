"""A trajectory is what an engine returns: arrays over time, and the mechanism's numbers.

Nothing here knows Drake. Results are made of these arrays alone, so that any engine serves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Place(NamedTuple):
    """Holds a frame fixed on a body: the body's number, and the frame's pose in it."""

    body: int
    rotation: Array  # (3, 3)
    translation: Array  # (3,) m


@dataclass(frozen=True)
class Bodies:
    """Holds the masses of all bodies, in the engine's order (b of them). SI units.

    Attributes:
        mass: (b,).
        com: (b, 3) centre of mass from the body's origin, in its axes.
        moments: (b, 3, 3) rotational inertia about the body's origin, in its axes.

    """

    mass: Array
    com: Array
    moments: Array

    def __len__(self) -> int:
        """How many bodies there are."""
        return len(self.mass)


@dataclass(frozen=True)
class JointSprings:
    """Says what joints hold beside their bodies: linear springs and rotors.

    Attributes:
        position: (s,) places in q.
        stiffness: (s,) N m/rad or N/m.  nominal: (s,) rad or m.
        rotor_velocity: (r,) places in v.  rotor_inertia: (r,) kg m^2 or kg.

    """

    position: NDArray[np.int64]
    stiffness: Array
    nominal: Array
    rotor_velocity: NDArray[np.int64]
    rotor_inertia: Array


@dataclass(frozen=True)
class JointRanges:
    """Holds the passive torques at the ends of joints' ranges; see `limbs.limits`.

    Attributes:
        position, velocity: (j,) places in q and in v.
        lower, upper: (j,) rad.  stiffness: (j,) N m/rad.  damping: (j,) s/rad.

    """

    position: NDArray[np.int64]
    velocity: NDArray[np.int64]
    lower: Array
    upper: Array
    stiffness: Array
    damping: Array


@dataclass(frozen=True)
class LimbNumbers:
    """Holds the numbers of a limb that holds the racket.

    Attributes:
        bodies: numbers of its bodies.  massive: those that have mass.
        coordinates: names of its coordinates.  prismatic: those in m, not rad.
        position, velocity: places of the coordinates in q and in v.
        springs: on its joints, and on others of its models.
        ranges: of its joints; None without passive limits.
        notes: what a user should know about how the limb was read.

    """

    bodies: tuple[int, ...]
    massive: tuple[int, ...]
    coordinates: tuple[str, ...]
    prismatic: tuple[str, ...]
    position: NDArray[np.int64]
    velocity: NDArray[np.int64]
    springs: JointSprings
    ranges: JointRanges | None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class FrameJointNumbers:
    """Holds the joints of the racket's frame, in order from the butt.

    Attributes:
        names: of the joints.
        planes: of each: `in_plane`, `out_of_plane` or `torsion`.
        position, velocity: (j,) places in q and in v.
        stiffness: (j,) N m/rad.

    """

    names: tuple[str, ...]
    planes: tuple[str, ...]
    position: NDArray[np.int64]
    velocity: NDArray[np.int64]
    stiffness: Array

    def angle(self, plane: str, q: Array) -> Array:
        """Gives the sum of the joint angles of one plane (rad), of positions (n, nq): (n,)."""
        own = [i for i, name in enumerate(self.planes) if name == plane]
        return np.sum(q[:, self.position[own]], axis=1)  # type: ignore[no-any-return]


@dataclass(frozen=True)
class StringNumbers:
    """Holds the numbers of the string-bed.

    Attributes:
        points: numbers of the masses.  springs: names of the springs.
        bodies: numbers of the masses' bodies.
        position, velocity: (p,) places of the masses in q and in v.
        incidence: (s, p) the matrix A with dz = A z.
        constants: (4, s) as for `laws.strings.spring_law`.
        arms, folds: (s, j), (s, j, j) B and F of `laws.strings`, of j joints of the frame.
        arm_position, arm_velocity: (j,) places of these joints in q and in v.

    """

    points: tuple[int, ...]
    springs: tuple[str, ...]
    bodies: tuple[int, ...]
    position: NDArray[np.int64]
    velocity: NDArray[np.int64]
    incidence: Array
    constants: Array
    arms: Array
    folds: Array
    arm_position: NDArray[np.int64]
    arm_velocity: NDArray[np.int64]


@dataclass(frozen=True)
class Mechanism:
    """Holds the numbers of a mechanism that results are computed with. SI units.

    Attributes:
        bodies: all of them; the numbers below count in their order.
        racket: numbers of the racket's bodies.  handle, ball: of these two.
        ball_position, ball_velocity: where the place of the ball's centre and its velocity in the
            world begin in the state [q; v]; its angular velocity stands before the latter.
        frame: its joints.  strings: its string-bed.
        places: name -> frame: butt, gsc, tip, accelerometer; racket_grip and hand where a hand
            holds the racket; and the limb's landmarks.
        landmarks, segments: names of places of hand and limb, and pairs of them.
        num_positions: length of q.  gravity: (3,) in the world.
        limb: that holds the racket; None without one.
        hand: number of the body of a hand that has mass; None without one.

    """

    bodies: Bodies
    racket: tuple[int, ...]
    handle: int
    ball: int
    ball_position: int
    ball_velocity: int
    frame: FrameJointNumbers
    strings: StringNumbers
    places: Mapping[str, Place]
    num_positions: int
    gravity: Array
    limb: LimbNumbers | None = None
    hand: int | None = None
    landmarks: tuple[str, ...] = ()
    segments: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Motion:
    """The motion says how all bodies move at some samples of a trajectory (m), in the world.

    Attributes:
        samples: (m,) numbers of the samples.
        poses: (m, b, 3, 4) rotation and origin of each body.
        velocities: (m, b, 6) angular (rad/s) and linear (m/s) velocity of each body's origin; 0 for
            bodies without mass.
        sensor_acceleration: (m, 6) of the origin of the body that holds the place `accelerometer`;
            NaN from a discrete plant.
        hand_load: (m, 6) torque and force of the racket on the hand, in its axes; None without one.
        joint_torque: (m, j) on the limb's joints; None without a limb.
        joint_reaction: (m, j) magnitude of the reaction force (N); None without a limb.

    """

    samples: NDArray[np.int64]
    poses: Array
    velocities: Array
    sensor_acceleration: Array
    hand_load: Array | None = None
    joint_torque: Array | None = None
    joint_reaction: Array | None = None


@dataclass(frozen=True)
class Trajectory:
    """A trajectory is one run (n samples: the start, each step's end, the end).

    Attributes:
        mechanism: whose motion it is.
        time: (n,) s, from the start of the run; touch and release are among the times.
        state: (n, nq + nv) positions q and velocities v, SI units and radians.
        record: (n, 17), from a discrete plant (n, 31), of contact surface (n, 32): what the contact
            has latched, after any event at that time; see `laws.phases` and `laws.surface`.
        contact: (n, 9) phase; point in contact, or to be hit; compression (m) and its rate (m/s);
            normal force and friction (N); sliding velocity (m/s); see `BallContact`. Apart from the
            phase and the forces these are NaN before and after contact if the motion was not asked
            for at every sample.
        totals: (n, 9) lost so far (J, N s, N m s), NaN without an audit; with a limb (n, 12).
        motion: at every sample, or at the first and the last.
        steps, evaluations: of the integrator.
        engine: its name.
        element: (n, 2) the element between ball and strings of contact surface (m); else (n, 0).

    """

    mechanism: Mechanism
    time: Array
    state: Array
    record: Array
    contact: Array
    totals: Array
    motion: Motion
    steps: int
    evaluations: int
    engine: str = field(default="drake")
    element: Array = field(default_factory=lambda: np.zeros((0, 0)))

    def __len__(self) -> int:
        """How many samples it has."""
        return len(self.time)

    def audited(self) -> bool:
        """Tells whether losses were integrated beside the motion."""
        return bool(np.isfinite(self.totals[:, 0]).all())


def cross(a: Array, b: Array) -> Array:
    """Gives a x b along the last axis: the numbers of np.cross, which takes many times as long."""
    found = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return found
