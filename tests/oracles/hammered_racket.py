"""The free two-body racket in one plane under a force on its handle: small motion, mode by mode.

Coordinates as in `two_body`: y of the joint, rotations p1 of the handle and p2 of the head; the
handle's point at s from the butt moves by u = y - (l1 - s) p1. Mass matrix from the two bodies'
kinetic energies, stiffness and damping from the joint angle p2 - p1. Both have rank one, so damping
couples no modes: the eigenvectors of (K, M), scaled to unit modal mass, give two rigid modes

    a(t) = phi^2 F(t)

and one of bending with w^2 = k e^2, 2 sigma = c e^2 (e the mode's joint angle),

    q'' + 2 sigma q' + w^2 q = phi F(t),

whose response to half a sine, F = P Im exp(i W t) on [0, L], is the convolution with
h(t) = Im(exp(l t)) / w_d, l = -sigma + i w_d, done in closed form.

The acceleration of a point in the handle's axes is u'' to first order.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.signal import StateSpace, lsim


@dataclass(frozen=True)
class HammeredRacket:
    """m, l, c, I as in `two_body`; k, c_joint of the joint; s, the place hit, from the butt."""

    m1: float
    l1: float
    c1: float
    I1: float
    m2: float
    c2: float
    I2: float
    k: float
    c_joint: float
    s: float

    def matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Mass matrix, K / k, and the row that gives u."""
        rows = np.array(
            [[1.0, -(self.l1 - self.c1), 0.0], [1.0, 0.0, self.c2], [0, 1.0, 0], [0, 0, 1.0]]
        )
        mass = rows.T @ np.diag([self.m1, self.m2, self.I1, self.I2]) @ rows
        bend = np.array([0.0, -1.0, 1.0])
        return mass, np.outer(bend, bend), np.array([1.0, -(self.l1 - self.s), 0.0])

    def modes(self) -> tuple[np.ndarray, float, float]:
        """Displacements of the place in the three modes, and w, sigma of the last."""
        mass, bend, place = self.matrices()
        values, vectors = eigh(self.k * bend, mass)
        e2 = float(vectors[:, 2] @ bend @ vectors[:, 2])
        return place @ vectors, float(np.sqrt(values[2])), 0.5 * self.c_joint * e2

    def half_sine(self, time: np.ndarray, peak: float, length: float) -> np.ndarray:
        """Acceleration (m/s^2) of the place at `time` (s)."""
        phi, w, sigma = self.modes()
        w_d = np.sqrt(w * w - sigma * sigma)
        pole, drive = complex(-sigma, w_d), 1j * np.pi / length
        until = np.minimum(time, length)
        force = np.where(time <= length, peak * np.sin(np.pi * time / length), 0.0)

        def convolved(exponent: complex, derivative: int) -> np.ndarray:
            """Integral of exponent^derivative exp(exponent (t - tau)) exp(drive tau), tau to L."""
            integral = np.expm1((drive - exponent) * until) / (drive - exponent)
            return exponent**derivative * np.exp(exponent * time) * integral

        def response(derivative: int) -> np.ndarray:
            both = convolved(pole, derivative) - convolved(pole.conjugate(), derivative)
            return np.asarray((peak * both / (2j * w_d)).imag)

        q, rate = phi[2] * response(0), phi[2] * response(1)
        bending = phi[2] * force - 2.0 * sigma * rate - w * w * q
        return (phi[0] ** 2 + phi[1] ** 2) * force + phi[2] * bending

    def straight_pulse(self, time: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Acceleration under a force that is straight between samples an equal step apart."""
        mass, bend, place = self.matrices()
        inverse = np.linalg.inv(mass)
        system = np.block(
            [
                [np.zeros((3, 3)), np.eye(3)],
                [-self.k * inverse @ bend, -self.c_joint * inverse @ bend],
            ]
        )
        put = np.concatenate([np.zeros(3), inverse @ place])
        out = place @ system[3:]
        space = StateSpace(system, put[:, None], out[None, :], [[float(place @ inverse @ place)]])
        return np.asarray(lsim(space, force, time, interp=True)[1])
