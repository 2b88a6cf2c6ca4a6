"""Tells where the energy and the momentum are, at one instant or over a whole run.

What is lost is integrated beside the motion (`plant.systems.energy_meter`), at the integrator's own
order, so that the balance closes as well as the motion is solved. What is there is computed here
from the motion of the bodies, for all samples at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from drake_racket.engines.trajectory import Mechanism, Motion, Trajectory, cross
from drake_racket.laws.contact import CONTACT, stored_energy
from drake_racket.laws.limits import limit_energies
from drake_racket.laws.phases import GIVEN_UP, HB, KB, PHASE
from drake_racket.laws.strings import bent_energy, spring_energy
from drake_racket.laws.surface import KT
from drake_racket.laws.totals import (
    COUPLE,
    GRIP,
    IMPULSE,
    LOST_BALL,
    LOST_FRICTION,
    LOST_JOINT,
    LOST_JOINTS,
    LOST_LIMITS,
    LOST_STRINGS,
    TORQUE_WORK,
    TOTALS,
)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RigidMotion:
    """Holds the motion of the rigid body with the racket's present mass distribution and momentum.

    One value, or one for each of m samples.

    Attributes:
        mass: kg.
        velocity: of the centre of mass, in the world (m/s).
        angular_velocity: in the world (rad/s).
        kinetic_energy: J.

    """

    mass: float
    velocity: Array
    angular_velocity: Array
    kinetic_energy: Array


@dataclass(frozen=True)
class Balance:
    """Holds the energies (J) and momenta (N s; N m s about the world's origin) at one instant.

    ball: kinetic. contact: stored in the compressed ball. rigid_motion: of the racket as one rigid
    body with its momentum (0 if clamped). bending: stored at the frame's joints, and the frame's
    kinetic energy beyond the rigid motion. strings: stored, and kinetic relative to the head.
    gravity: potential of racket and ball. grip: gone into a hand's springs and dampers, and into
    its own motion where it has mass. limb: kinetic, potential, and stored at its joints' limits;
    torque_work: done by its joint torques.
    lost_*: given up so far; lost_ball includes what compression was left at release. couple: gained
    from forces that act along different lines.
    """

    ball: float
    contact: float
    rigid_motion: float
    bending: float
    strings: float
    gravity: float
    grip: float
    limb: float
    torque_work: float
    lost_limb: float
    lost_ball: float
    lost_friction: float
    lost_joint: float
    lost_strings: float
    couple: float
    linear_momentum: Array
    angular_momentum: Array
    ball_momentum: Array
    impulse_on_ball: Array

    def total(self) -> float:
        """Sums what is constant if the run is exact."""
        return float(sum(sign * getattr(self, name) for name, sign in _SIGNS.items()))


STORES = tuple(f.name for f in fields(Balance) if not f.name.endswith(("momentum", "on_ball")))
"""Names of the energies of a balance."""

_SIGNS = {name: -1.0 if name in ("torque_work", "couple") else 1.0 for name in STORES}


@dataclass(frozen=True)
class Balances:
    """Holds the balance at m samples.

    Attributes:
        energies: (m, 15) J, in the order of STORES.
        linear_momentum, angular_momentum: (m, 3) of racket and ball.
        ball_momentum, impulse_on_ball: (m, 3).

    """

    energies: Array
    linear_momentum: Array
    angular_momentum: Array
    ball_momentum: Array
    impulse_on_ball: Array

    def totals(self) -> Array:
        """Gives the energy (m,) that is constant if the run is exact (J)."""
        return np.sum([s * self.store(n) for n, s in _SIGNS.items()], axis=0)  # type: ignore[no-any-return]

    def store(self, name: str) -> Array:
        """Gives the energy (m,) in one of STORES (J)."""
        return self.energies[:, STORES.index(name)]

    def at(self, sample: int) -> Balance:
        """Gives the balance at one of the samples."""
        energies = {n: float(e) for n, e in zip(STORES, self.energies[sample], strict=True)}
        return Balance(
            **energies,
            linear_momentum=self.linear_momentum[sample],
            angular_momentum=self.angular_momentum[sample],
            ball_momentum=self.ball_momentum[sample],
            impulse_on_ball=self.impulse_on_ball[sample],
        )


def balances(trajectory: Trajectory, *, held: bool) -> Balances:
    """Gives the balance at every sample of which the trajectory has the motion.

    Args:
        trajectory: of an audited run.
        held: the racket is welded to the world; its rigid motion then counts as bending.

    """
    mechanism, motion = trajectory.mechanism, trajectory.motion
    q, v = _state(trajectory)
    totals, record = trajectory.totals[motion.samples], trajectory.record[motion.samples]
    moving = Momenta.of(mechanism, motion)
    racket, ball = list(mechanism.racket), [mechanism.ball]
    rigid = rigid_motion(moving, racket).kinetic_energy
    rigid = 0.0 * rigid if held else rigid
    strings = mechanism.strings
    rates = v[:, strings.velocity]
    string_motion = 0.5 * (rates * rates) @ mechanism.bodies.mass[list(strings.bodies)]
    bent = q[:, mechanism.frame.position]
    bending = 0.5 * (bent * bent) @ mechanism.frame.stiffness
    bending = bending + moving.kinetic_energy(racket) - rigid - string_motion
    limb, torque_work, lost_limb = _limb_energies(trajectory, moving, q, v, totals)
    columns = {
        "ball": moving.kinetic_energy(ball),
        "contact": _stored_in_ball(trajectory),
        "rigid_motion": rigid,
        "bending": bending,
        "strings": stored_in_strings(mechanism, q) + string_motion,
        "gravity": moving.potential(racket + ball, mechanism.gravity),
        "grip": totals[:, GRIP] + _in_hand(mechanism, moving),
        "limb": limb,
        "torque_work": torque_work,
        "lost_limb": lost_limb,
        "lost_ball": totals[:, LOST_BALL] + record[:, GIVEN_UP],
        "lost_friction": totals[:, LOST_FRICTION],
        "lost_joint": totals[:, LOST_JOINT],
        "lost_strings": totals[:, LOST_STRINGS],
        "couple": totals[:, COUPLE],
    }
    return Balances(
        energies=np.stack([columns[name] for name in STORES], axis=1),
        linear_momentum=np.sum(moving.linear[:, racket + ball], axis=1),
        angular_momentum=np.sum(moving.angular[:, racket + ball], axis=1),
        ball_momentum=moving.linear[:, mechanism.ball],
        impulse_on_ball=totals[:, IMPULSE],
    )


def _in_hand(mechanism: Mechanism, moving: Momenta) -> Array | float:
    """Kinetic and potential energy (m,) of a hand that has mass (J)."""
    if mechanism.hand is None:
        return 0.0
    own = [mechanism.hand]
    return moving.kinetic_energy(own) + moving.potential(own, mechanism.gravity)


@dataclass(frozen=True)
class Momenta:
    """Holds the momentum and energy of every body at m samples, in the world.

    Attributes:
        mass: (b,) kg.
        place: (m, b, 3) centres of mass (m).
        moments: (m, b, 3, 3) about the bodies' centres of mass, in the world's axes (kg m^2).
        linear: (m, b, 3) N s.
        angular: (m, b, 3) about the world's origin (N m s).
        kinetic: (m, b) J.

    """

    mass: Array
    place: Array
    moments: Array
    linear: Array
    angular: Array
    kinetic: Array

    @staticmethod
    def of(mechanism: Mechanism, motion: Motion) -> Momenta:
        """Gives P = m (v + w x c), L = I w + r x p, and (p.v_cm + w.I w) / 2, body by body."""
        bodies = mechanism.bodies
        rotation, origin = motion.poses[..., :3], motion.poses[..., 3]
        w, v = motion.velocities[..., :3], motion.velocities[..., 3:]
        central = bodies.moments - bodies.mass[:, None, None] * _square(bodies.com)
        place, velocity = origin.copy(), v.copy()
        moments, spin = np.zeros((*origin.shape, 3)), np.zeros(origin.shape)
        # all but the string masses, which are points at their origins
        b = np.flatnonzero(np.any(bodies.moments != 0.0, axis=(1, 2)))
        c = np.einsum("mbij,bj->mbi", rotation[:, b], bodies.com[b])
        moments[:, b] = rotation[:, b] @ central[b] @ np.swapaxes(rotation[:, b], -1, -2)
        place[:, b] += c
        velocity[:, b] += cross(w[:, b], c)
        spin[:, b] = np.einsum("mbij,mbj->mbi", moments[:, b], w[:, b])
        linear = bodies.mass[:, None] * velocity
        kinetic = np.einsum("mbi,mbi->mb", linear, velocity) + np.einsum("mbi,mbi->mb", spin, w)
        angular = spin + cross(place, linear)
        return Momenta(bodies.mass, place, moments, linear, angular, 0.5 * kinetic)

    def kinetic_energy(self, bodies: Sequence[int]) -> Array:
        """Gives the kinetic energy (m,) of some bodies (J)."""
        return np.sum(self.kinetic[:, list(bodies)], axis=1)  # type: ignore[no-any-return]

    def centre_of_mass(self, bodies: Sequence[int]) -> Array:
        """Gives the common centre of mass (m, 3) of some bodies (m)."""
        mass = self.mass[list(bodies)]
        found: Array = np.einsum("b,mbi->mi", mass, self.place[:, list(bodies)]) / np.sum(mass)
        return found

    def potential(self, bodies: Sequence[int], gravity: Array) -> Array:
        """Gives Gravity's potential (m,) of some bodies (J)."""
        along: Array = self.centre_of_mass(bodies) @ gravity
        return -np.sum(self.mass[list(bodies)]) * along


def rigid_motion(moving: Momenta, bodies: Sequence[int]) -> RigidMotion:
    """Gives the rigid motion of some bodies: v = P / m, w = I^-1 L about their centre of mass."""
    chosen = list(bodies)
    total = float(np.sum(moving.mass[chosen]))
    com = moving.centre_of_mass(chosen)
    linear = np.sum(moving.linear[:, chosen], axis=1)
    angular = np.sum(moving.angular[:, chosen], axis=1) - cross(com, linear)
    arms = moving.place[:, chosen] - com[:, None, :]
    moments = np.sum(moving.moments[:, chosen], axis=1)
    moments += np.einsum("b,mbij->mij", moving.mass[chosen], _square(arms))
    w = np.linalg.solve(moments, angular[..., None])[..., 0]
    v = linear / total
    energy = 0.5 * (np.einsum("mi,mi->m", linear, v) + np.einsum("mi,mi->m", angular, w))
    return RigidMotion(total, v, w, energy)


def stored_in_strings(mechanism: Mechanism, q: Array) -> Array:
    """Gives the energy (m,) (J) of the springs above the flat bed."""
    strings = mechanism.strings
    dz = q[:, strings.position] @ strings.incidence.T
    if strings.arms.size:
        bent = q[:, strings.arm_position]
        sag = np.einsum("sab,ma,mb->ms", strings.folds, bent, bent)
        dz = dz + bent @ strings.arms.T
        return np.sum(bent_energy(dz, sag, strings.constants), axis=1)  # type: ignore[no-any-return]
    k, slack, length2, _ = strings.constants
    return np.sum(spring_energy(dz, k, slack, length2), axis=1)  # type: ignore[no-any-return]


def _square(r: Array) -> Array:
    """|r|^2 1 - r r^T: what a unit mass at r adds to the moments about the origin."""
    dot = np.einsum("...i,...i->...", r, r)
    return dot[..., None, None] * np.eye(3) - r[..., :, None] * r[..., None, :]  # type: ignore[no-any-return]


def _state(trajectory: Trajectory) -> tuple[Array, Array]:
    """Q and v at the samples of the motion."""
    state = trajectory.state[trajectory.motion.samples]
    count = trajectory.mechanism.num_positions
    return state[:, :count], state[:, count:]


def _stored_in_ball(trajectory: Trajectory) -> Array:
    """Of compression and of shear, in contact, (m,) (J)."""
    record = trajectory.record[trajectory.motion.samples]
    x = trajectory.contact[trajectory.motion.samples, 2]
    stored = np.asarray(stored_energy(x, record[:, KB], record[:, HB]))
    if trajectory.element.size:
        u = trajectory.element[trajectory.motion.samples]
        stored = stored + 0.5 * record[:, KT] * np.einsum("mi,mi->m", u, u)
    return np.where(record[:, PHASE] == CONTACT, stored, 0.0)


def _limb_energies(
    trajectory: Trajectory, moving: Momenta, q: Array, v: Array, totals: Array
) -> tuple[Array, Array, Array]:
    """Energy in the limb, work of its torques, and what it has lost, (m,) each (J)."""
    mechanism = trajectory.mechanism
    limb = mechanism.limb
    zero = np.zeros(len(q))
    if limb is None:
        return zero, zero, zero
    energy = moving.kinetic_energy(limb.massive) + moving.potential(limb.bodies, mechanism.gravity)
    springs = limb.springs
    stretched = q[:, springs.position] - springs.nominal
    energy = energy + 0.5 * (stretched * stretched) @ springs.stiffness
    turning = v[:, springs.rotor_velocity]
    energy = energy + 0.5 * (turning * turning) @ springs.rotor_inertia
    if limb.ranges is not None:
        r = limb.ranges
        held = limit_energies(q[:, r.position], r.lower, r.upper, r.stiffness)
        energy = energy + np.sum(held, axis=1)
    own = totals[:, TOTALS:]
    return energy, own[:, TORQUE_WORK], own[:, LOST_JOINTS] + own[:, LOST_LIMITS]
