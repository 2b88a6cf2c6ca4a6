"""Models the linear racket under the hammer, with exact derivatives.

Of two segments, in one plane, with the velocities of the base and the joint, M x'' = u F - e (kf q + cf q'), where
q is the joint's angle, e its unit vector and u the motion of the place that is hit and measured.
With M inverted, the joint's angle and the acceleration of the place are

    J q'' + cf q' + kf q = J b F,     1 / J = e M^-1 e,    b = e M^-1 u,
    acceleration = r F - b (kf q + cf q'),    r = u M^-1 u.

Under a force that is straight between samples h apart, the damped mode's z = q' - conj(l) q, with
l = -s + i w, 2 s = cf / J and s^2 + w^2 = kf / J, is known exactly from sample to sample:

    z[n+1] = E z[n] + b (A F[n] + B F[n+1]),    E = exp(l h),    q = Im z / w,
    A + B = (E - 1) / l,    B = (E - 1 - l h) / (l^2 h),

and its derivative by l obeys the same recursion. The mode and the record are both sums over these.

More segments have more joints in the plane. All joints' constants are those of the throat joint
times numbers c of the distribution, c_i kf and c_i cf. The modes phi of c phi = (1 / J) M_qq phi, with
phi^T c phi = 1 and M_qq the mass matrix of the joints on a free base, then each obey the equation
above with a J and a b of their own, and the acceleration is r F less the sum over the modes. So kf
stays what it is in the racket's file, the number that gives the fundamental frequency.

Once the pulse is over the acceleration is the free mode alone: there an error of the hammer's
calibration or of the timing between the two channels changes only size and phase of it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from pydrake.multibody.plant import MultibodyPlant
from scipy.signal import lfilter

from drake_racket.parameters.racket import RacketParameters
from drake_racket.parameters.segments import segment_at
from drake_racket.plant.racket import add_racket
from drake_racket.rigs.hammer.impact_hammer import DIRECTIONS

Array = NDArray[np.float64]

FAR = 8.0
"""Of a pole times the step, from where on a power series is not exact."""


@dataclass(frozen=True)
class HammeredFrame:
    """Says what the masses of a bare racket say of a hit and an acceleration at one place.

    Attributes:
        inertia: J, kg m^2, that the joint's angle sees.
        coupling: b, 1/(kg m): angular acceleration of the joint per force.
        direct: r, 1/kg: acceleration of the place per force, the joint loose.
        node: of the mode on the handle, m from the butt.
        participation: motion of the place in the mode over that of the butt, signed.
        higher: J and b of the other modes in the plane; none of two segments. The fields above are
            those of the fundamental one.

    """

    inertia: float
    coupling: float
    direct: float
    node: float
    participation: float
    higher: tuple[tuple[float, float], ...] = ()

    def pole(self, stiffness: float, damping: float) -> tuple[complex, complex, complex]:
        """Gives the mode's l (1/s) and its derivatives by kf and cf; underdamped only."""
        s = 0.5 * damping / self.inertia
        w = math.sqrt(stiffness / self.inertia - s * s)
        by_damping = complex(-0.5 / self.inertia, -0.5 * s / (self.inertia * w))
        return complex(-s, w), complex(0.0, 0.5 / (self.inertia * w)), by_damping

    def bending(
        self, force: Array, step: float, *, stiffness: float, damping: float, delay: float = 0.0
    ) -> tuple[Array, Array]:
        """Tells what the bending adds to the acceleration of the place, from rest.

        Args:
            force: (n,) N, straight between samples `step` (s) apart.
            stiffness: kf, N m/rad, positive.  damping: cf, N m s/rad, below critical.
            delay: s, of the acceleration after the force; exact where the force is over.

        Returns:
            (n,) m/s^2, and (n, 3) its derivatives by kf, cf and the delay.

        """
        pole, *by_constants = self.pole(stiffness, damping)
        z, z_pole = _recursion(pole, force, step)
        w, scale = pole.imag, self.inertia * self.coupling * np.exp(-pole * delay)
        # -b (kf q + cf q') = b J (q'' - b F), and q'' = Im(l^2 z) / w + b F
        mode = scale * self.coupling * pole**2 * z
        by_pole = scale * self.coupling * (2.0 * pole * z + pole**2 * z_pole) - delay * mode
        value = mode.imag / w
        columns = [((by_pole * x).imag - value * x.imag) / w for x in by_constants]
        columns.append(-(pole * mode).imag / w)
        by = np.stack(columns, axis=1)
        for inertia, coupling in self.higher:
            more, more_by = _higher(
                inertia, coupling, force, step, stiffness=stiffness, damping=damping, delay=delay
            )
            value, by = value + more, by + more_by
        return value, by

    def acceleration(self, force: Array, step: float, *, stiffness: float, damping: float) -> Array:
        """Gives the whole acceleration of the place, m/s^2; arguments as `bending`."""
        bending, _ = self.bending(force, step, stiffness=stiffness, damping=damping)
        return self.direct * force + bending


def _higher(
    inertia: float,
    coupling: float,
    force: Array,
    step: float,
    *,
    stiffness: float,
    damping: float,
    delay: float,
) -> tuple[Array, Array]:
    """What a higher mode adds, and its derivatives, as `bending`; it may be damped beyond ringing.

    With the poles l and m of J q'' + cf q' + kf q = 0 the mode is (g(l) - g(m)) / (l - m), where g
    has each pole's own recursion. What does not ring is over with the pulse, and is not delayed.
    """
    s = 0.5 * damping / inertia
    root = np.sqrt(complex(s * s - stiffness / inertia))
    if abs(root) < 1e-6 * s:  # critical to six digits: as good as just below
        root = complex(0.0, 1e-6 * s)
    rings = root.imag != 0.0
    delay = delay if rings else 0.0
    by_stiffness = -0.5 / (inertia * root)  # of the root
    by_damping = 0.5 * s / (inertia * root)
    value = np.zeros(len(force), dtype=complex)
    by = np.zeros((len(force), 3), dtype=complex)
    for sign in (1.0, -1.0):
        pole = -s + sign * root
        z, z_pole = _recursion(pole, force, step)
        scale = inertia * coupling**2 * np.exp(-pole * delay) * sign / (2.0 * root)
        mode = scale * pole**2 * z
        by_pole = scale * (2.0 * pole * z + pole**2 * z_pole) - delay * mode
        value += mode
        by[:, 0] += by_pole * sign * by_stiffness - mode / root * by_stiffness
        turned = sign * by_damping - 0.5 / inertia
        by[:, 1] += by_pole * turned - mode / root * by_damping
        by[:, 2] -= pole * mode * rings
    return value.real, by.real


def _recursion(pole: complex, force: Array, step: float) -> tuple[Array, Array]:
    """The mode's z and dz/dl over the samples, for b = 1."""
    x = pole * step
    e = np.exp(x)
    first, second = _weights(x)  # A = h first, B = h second
    first_x, second_x = _weights(x, derivative=True)
    before = np.concatenate([[0.0], force[:-1]])
    here = np.concatenate([[0.0], force[1:]])  # at rest at the first sample
    drive = step * (first * before + second * here)
    z = lfilter([1.0], [1.0, -e], drive)
    drive_pole = step * step * (first_x * before + second_x * here)
    late = np.concatenate([[0.0], z[:-1]])
    return z, lfilter([1.0], [1.0, -e], drive_pole + step * e * late)


def _weights(x: complex, *, derivative: bool = False) -> tuple[complex, complex]:
    """Integrals of exp(x (1 - u)) (1 - u) and exp(x (1 - u)) u over 0 < u < 1, or by x.

    As power series in x = l h; the closed forms cancel at small x, and are for modes that die away
    within a sample.
    """
    if abs(x) > FAR:
        e = np.exp(x)
        whole, second = (e - 1.0) / x, (e - 1.0 - x) / x**2
        if derivative:
            whole, second = (e - whole) / x, (whole - 2.0 * second) / x
        return complex(whole - second), complex(second)
    first = second = 0.0 + 0.0j
    term = 1.0 + 0.0j  # x^n / n!
    for n in range(60):
        # of u^n u and u^n (1 - u); the derivative by x puts one more u in
        m = n + 1 if derivative else n
        first += term / (m + 2)
        second += term / ((m + 1) * (m + 2))
        term *= x / (n + 1)
    return first, second


def hammered_frame(racket: RacketParameters, direction: str, place: float) -> HammeredFrame:
    """Gives the bare racket at rest, hit and measured at `place`, from the plant's mass matrix.

    Args:
        direction: `in_plane` or `out_of_plane`.  place: m from the butt, on the handle.

    """
    plant = MultibodyPlant(0.0)
    added = add_racket(plant, racket, strung=False)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    mass = plant.CalcMassMatrix(context)
    joints = [j.velocity_start() for j in added.joints_of(direction)]
    others = {j.velocity_start() for j in added.frame_joints} - set(joints)
    free = [i for i in range(plant.num_velocities()) if i not in others]  # they do not move
    bends = np.eye(plant.num_velocities())[joints][:, free]
    segments = racket.frame_segments()

    def motion(at: float) -> Array:
        """Of the frame's point at `at`, along the hit, per generalized velocity."""
        on = segment_at(segments, at)
        rows = []
        for i in range(plant.num_velocities()):
            velocity = np.zeros(plant.num_velocities())
            velocity[i] = 1.0
            plant.SetVelocities(context, velocity)
            spatial = added.segments[on].EvalSpatialVelocityInWorld(context)
            arm = np.array([at - segments[on].origin, 0.0, 0.0])
            rows.append(spatial.Shift(arm).translational())
        return np.asarray(np.array(rows) @ np.array(DIRECTIONS[direction]))[free]

    inverse = np.linalg.inv(mass[np.ix_(free, free)])
    loose = bends @ inverse @ bends.T
    inertias, modes = np.array([1.0 / loose[0, 0]]), np.ones((1, 1))
    if len(joints) > 1:
        inertias, modes = _modes(np.linalg.inv(loose), _shares(racket, direction))
    to_modes = np.linalg.inv(modes)

    def couplings(u: Array) -> Array:
        return np.asarray(to_modes @ (bends @ inverse @ u))

    u, butt = motion(place), motion(0.0)
    at_butt, coupling = couplings(butt), couplings(u)
    return HammeredFrame(
        inertia=float(inertias[0]),
        coupling=float(coupling[0]),
        direct=float(u @ inverse @ u),
        node=_node([s.start for s in segments], lambda x: float(couplings(motion(x))[0])),
        participation=float(coupling[0] / at_butt[0]),
        higher=tuple(zip(inertias[1:].tolist(), coupling[1:].tolist(), strict=True)),
    )


def _modes(mass: Array, shares: Array) -> tuple[Array, Array]:
    """Inertias J of the modes, falling, and the modes as columns, each of unit stiffness."""
    squares, modes = scipy.linalg.eigh(np.diag(shares), mass)
    return 1.0 / squares, modes / np.sqrt(np.sum(shares[:, None] * modes**2, axis=0))


def _shares(racket: RacketParameters, direction: str) -> Array:
    """Stiffness of the joints of a plane over that of the throat joint."""
    whole, _ = racket.throat_joint.constants(direction)
    own = [joint.stiffness for joint in racket.frame_joints() if joint.plane == direction]
    return np.array(own) / whole


def _node(starts: Sequence[float], moved: Callable[[float], float]) -> float:
    """Where a mode first does not move, m from the butt; straight between the segments' starts."""
    places = [*starts, 1.0]
    for a, b in itertools.pairwise(places):
        last = b - 1e-9 * (b - a)  # still on the segment that starts at a
        at_a, at_b = moved(a), moved(last)
        if at_a * at_b <= 0.0:
            return a + (last - a) * at_a / (at_a - at_b)
    return math.inf
