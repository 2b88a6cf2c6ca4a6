"""States impacts at one speed as a least-squares problem."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drake_racket.identify.ball.impacts import BallImpact, Contact
from drake_racket.identify.ball.plate_sensitivity import plate_force
from drake_racket.identify.core.problem import Parameter


class PlateProblem:
    """Fits kb and cb to impacts at one speed, with each impact's speed and time of touch.

    Parameters: kb, cb, then `speed_i` of each impact (unless the speeds are held), then `touch_i`.
    Residuals: force (N) at the fitted samples, impact after impact; then, unless the speeds are
    held, estimated less measured speed, times noise / speed_sigma: that makes it a force as likely.
    """

    sigma: NDArray[np.float64] | None = None  # one for all residuals, from their scatter
    residual_unit = "N"

    def __init__(
        self,
        impacts: Sequence[BallImpact],
        contacts: Sequence[Contact],
        masses: Sequence[float],
        *,
        speed_sigma: float,
        noise: float,
    ) -> None:
        """Noise: N, of one sample of the force. speed_sigma: m/s, 0 to hold the speeds."""
        self.impacts, self.contacts, self.masses = impacts, contacts, masses
        self.held = speed_sigma == 0.0
        self.speed_weight = 0.0 if self.held else noise / speed_sigma
        self.measured = np.array([impact.speed for impact in impacts])
        self.records = [
            (i.force.time[c.samples], i.force.value[c.samples])
            for i, c in zip(impacts, contacts, strict=True)
        ]
        self.title = f"kb and cb at {self.measured.mean():.4g} m/s"
        self.parameters = self._parameters()

    def split(
        self, x: NDArray[np.float64]
    ) -> tuple[float, float, NDArray[np.float64], NDArray[np.float64]]:
        """Splits x into kb, cb, the speeds and the times of touch."""
        count = len(self.impacts)
        speeds = self.measured if self.held else x[2 : 2 + count]
        return float(x[0]), float(x[1]), speeds, x[-count:]

    def residuals(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gives the model less measured, N."""
        return self._both(x)[0]

    def jacobian(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gives the derivatives of the residuals, (m, n)."""
        return self._both(x)[1]

    def force_residuals(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gives the residuals of the force alone, N."""
        return self.residuals(x)[: sum(len(force) for _, force in self.records)]

    def fingerprint(self) -> str:
        """Gives the hash of the data and of what is asked of them."""
        digest = hashlib.sha256(repr((self.title, self.parameters, self.speed_weight)).encode())
        for (time, force), mass in zip(self.records, self.masses, strict=True):
            digest.update(np.concatenate([time, force, [mass]]).tobytes())
        return digest.hexdigest()

    def _both(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        kb, cb, speeds, touches = self.split(x)
        count = len(self.impacts)
        left, rows = [], []
        for i, (time, force) in enumerate(self.records):
            model, by = plate_force(
                time - touches[i], mass=self.masses[i], stiffness=kb, damping=cb, speed=speeds[i]
            )
            block = np.zeros((len(time), len(x)))
            block[:, :2] = by[:, :2]
            if not self.held:
                block[:, 2 + i] = by[:, 2]
            block[:, len(x) - count + i] = by[:, 3]
            left.append(model - force)
            rows.append(block)
        if not self.held:
            left.append(self.speed_weight * (speeds - self.measured))
            block = np.zeros((count, len(x)))
            block[:, 2 : 2 + count] = self.speed_weight * np.eye(count)
            rows.append(block)
        return np.concatenate(left), np.concatenate(rows)

    def _parameters(self) -> tuple[Parameter, ...]:
        kb, cb = _first_guess(self.contacts[0], self.masses[0])
        critical = 2.0 * math.sqrt(kb * self.masses[0])
        found = [
            Parameter("kb", "N/m", kb / 20.0, 20.0 * kb, kb),
            Parameter("cb", "N*s/m", 0.0, 4.0 * critical, cb),
        ]
        count = range(1, len(self.impacts) + 1)
        if not self.held:
            for i, v in zip(count, self.measured.tolist(), strict=True):
                found.append(Parameter(f"speed_{i}", "m/s", 0.8 * v, 1.2 * v, v))
        for i, c in zip(count, self.contacts, strict=True):
            # 1 % of noise leaves it open by more than a sample; a record that has begun by far more
            early = 1.5 * c.length if c.begun else 0.15 * c.length
            late = c.start + 0.15 * c.length
            found.append(Parameter(f"touch_{i}", "s", c.start - early, late, c.start))
        return tuple(found)


def _first_guess(contact: Contact, mass: float) -> tuple[float, float]:
    """Of kb and cb: those of the closed form with the contact's length and restitution."""
    whole = not (contact.begun or contact.cut_off)
    restitution = min(max(contact.restitution, 0.2), 0.98) if whole else 0.8
    ratio = -math.log(restitution) / math.hypot(math.pi, math.log(restitution))
    length = contact.length if whole else 1.5 * contact.length
    stiffness = mass * (2.0 * math.acos(ratio) / (math.sqrt(1.0 - ratio**2) * length)) ** 2
    return stiffness, 2.0 * ratio * math.sqrt(stiffness * mass)
