"""Models the linear two-body racket under the hammer, with exact derivatives.

In one plane, with the velocities of the base and the joint, M x'' = u F - e (kf q + cf q'), where
q is the joint's angle, e its unit vector and u the motion of the place that is hit and measured.
With M inverted, the joint's angle and the acceleration of the place are

    J q'' + cf q' + kf q = J b F,     1 / J = e M^-1 e,    b = e M^-1 u,
    acceleration = r F - b (kf q + cf q'),    r = u M^-1 u.

Under a force that is straight between samples h apart, the damped mode's z = q' - conj(l) q, with
l = -s + i w, 2 s = cf / J and s^2 + w^2 = kf / J, is known exactly from sample to sample:

    z[n+1] = E z[n] + b (A F[n] + B F[n+1]),    E = exp(l h),    q = Im z / w,
    A + B = (E - 1) / l,    B = (E - 1 - l h) / (l^2 h),

and its derivative by l obeys the same recursion. The mode and the record are both sums over these.

Once the pulse is over the acceleration is the free mode alone: there an error of the hammer's
calibration or of the timing between the two channels changes only size and phase of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.plant import MultibodyPlant
from scipy.signal import lfilter

from drake_racket.parameters.racket import RacketParameters
from drake_racket.parameters.segments import need_two
from drake_racket.plant.racket import add_racket
from drake_racket.rigs.hammer.impact_hammer import DIRECTIONS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class HammeredFrame:
    """Says what the masses of a bare racket say of a hit and an acceleration at one place.

    Attributes:
        inertia: J, kg m^2, that the joint's angle sees.
        coupling: b, 1/(kg m): angular acceleration of the joint per force.
        direct: r, 1/kg: acceleration of the place per force, the joint loose.
        node: of the mode on the handle, m from the butt.
        participation: motion of the place in the mode over that of the butt, signed.

    """

    inertia: float
    coupling: float
    direct: float
    node: float
    participation: float

    def pole(self, stiffness: float, damping: float) -> tuple[complex, complex, complex]:
        """Gives the mode's l (1/s) and its derivatives by kf and cf; underdamped only."""
        s = 0.5 * damping / self.inertia
        w = math.sqrt(stiffness / self.inertia - s * s)
        by_damping = complex(-0.5 / self.inertia, -0.5 * s / (self.inertia * w))
        return complex(-s, w), complex(0.0, 0.5 / (self.inertia * w)), by_damping

    def bending(
        self, force: Array, step: float, *, stiffness: float, damping: float, delay: float = 0.0
    ) -> tuple[Array, Array]:
        """Tells what the mode adds to the acceleration of the place, from rest.

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
        return value, np.stack(columns, axis=1)

    def acceleration(self, force: Array, step: float, *, stiffness: float, damping: float) -> Array:
        """Gives the whole acceleration of the place, m/s^2; arguments as `bending`."""
        bending, _ = self.bending(force, step, stiffness=stiffness, damping=damping)
        return self.direct * force + bending


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

    As power series in x = l h, at most a few radians; the closed forms cancel at small x.
    """
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

    Raises:
        InputError: a frame of more than two segments.

    """
    need_two(racket, "hammered_frame: racket")
    plant = MultibodyPlant(0.0)
    added = add_racket(plant, racket, strung=False)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    mass = plant.CalcMassMatrix(context)
    joint = getattr(added, direction).velocity_start()
    other = getattr(
        added, "out_of_plane" if direction == "in_plane" else "in_plane"
    ).velocity_start()
    free = [i for i in range(plant.num_velocities()) if i != other]  # it does not move
    bend = np.zeros(plant.num_velocities())
    bend[joint] = 1.0

    def motion(at: float) -> Array:
        """Of the handle's point at `at`, along the hit, per generalized velocity."""
        rows = []
        for i in range(plant.num_velocities()):
            velocity = np.zeros(plant.num_velocities())
            velocity[i] = 1.0
            plant.SetVelocities(context, velocity)
            spatial = added.handle.EvalSpatialVelocityInWorld(context)
            rows.append(spatial.Shift(np.array([at, 0.0, 0.0])).translational())
        return np.asarray(np.array(rows) @ np.array(DIRECTIONS[direction]))

    inverse = np.linalg.inv(mass[np.ix_(free, free)])
    u, butt, e = motion(place)[free], motion(0.0)[free], bend[free]
    turn = (motion(1.0)[free] - butt) @ inverse @ e  # per metre
    at_butt = float(e @ inverse @ butt)
    coupling = float(e @ inverse @ u)
    return HammeredFrame(
        inertia=1.0 / float(e @ inverse @ e),
        coupling=coupling,
        direct=float(u @ inverse @ u),
        node=-at_butt / float(turn),
        participation=coupling / at_butt,
    )
