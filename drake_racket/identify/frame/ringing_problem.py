"""Strikes on one racket in one direction as a least-squares problem: kf, cf, and the hammer's gain.

What is fitted is the ringing after the pulse, where noise of the hammer's force is over. It has
reached size and phase of the ringing, though, as has an error of either calibration or of the
accelerometer's place: each strike has a gain and a delay of its own, which take up just these.
Frequency and decay are left to kf and cf.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drake_racket.identify.core.problem import Parameter
from drake_racket.identify.frame.hammer_model import HammeredFrame
from drake_racket.identify.frame.hammer_record import HammerRecord

Array = NDArray[np.float64]

WIDEST = 3.0  # kf is sought between its first guess over and times this
MOST_DAMPING = 0.5  # ratio at the softest joint: below critical at every kf
MOST_GAIN = 5.0
MOST_PHASE = 0.125  # of a period, that the delay may be


class RingingProblem:
    """Fits kf (N m/rad), cf (N m s/rad), then `gain_i` (1) and `delay_i` (s) per strike.

    Residuals: m/s^2, model less measured after the pulse, strike after strike.
    """

    sigma: Array | None = None  # one for all, from their scatter
    residual_unit = "m/s^2"

    def __init__(
        self,
        records: Sequence[HammerRecord],
        frame: HammeredFrame,
        start: tuple[float, float],
        *,
        corrections: Sequence[Array] | None = None,
        title: str = "kf and cf",
    ) -> None:
        """Start: kf, cf. corrections: m/s^2 over each record, to add to the linear model's."""
        self.records, self.frame, self.title = records, frame, title
        self.corrections = corrections or [np.zeros(len(r.force)) for r in records]
        stiffness, damping = start
        period = 2.0 * math.pi * math.sqrt(frame.inertia / stiffness)
        softest = stiffness / WIDEST
        most = 2.0 * MOST_DAMPING * math.sqrt(softest * frame.inertia)
        damping = min(max(damping, 1e-3 * most), 0.9 * most)
        found = [
            Parameter("kf", "N*m/rad", softest, WIDEST * stiffness, stiffness),
            Parameter("cf", "N*m*s/rad", 0.0, most, damping),
        ]
        for i, record in enumerate(records, start=1):
            late = min(0.5 * record.pulse, MOST_PHASE * period)
            found.append(Parameter(f"gain_{i}", "1", 1.0 / MOST_GAIN, MOST_GAIN, 1.0))
            found.append(Parameter(f"delay_{i}", "s", -late, late, 0.0))
        self.parameters: tuple[Parameter, ...] = tuple(found)

    def residuals(self, x: Array) -> Array:
        """Gives the model less measured, m/s^2."""
        return self._both(x)[0]

    def jacobian(self, x: Array) -> Array:
        """Gives the derivatives of the residuals, (m, n)."""
        return self._both(x)[1]

    def fingerprint(self) -> str:
        """Gives the hash of the data and of what is asked of them."""
        digest = hashlib.sha256(repr((self.title, self.parameters, self.frame)).encode())
        for record, correction in zip(self.records, self.corrections, strict=True):
            digest.update(repr((record.step, record.after)).encode())
            for numbers in (record.force, record.acceleration, correction):
                digest.update(numbers.tobytes())
        return digest.hexdigest()

    def _both(self, x: Array) -> tuple[Array, Array]:
        left, rows = [], []
        for i, record in enumerate(self.records):
            gain, delay = x[2 + 2 * i], x[3 + 2 * i]
            bending, by = self.frame.bending(
                record.force, record.step, stiffness=x[0], damping=x[1], delay=delay
            )
            after = slice(record.after, None)
            model = gain * bending + self.corrections[i]
            block = np.zeros((len(bending), len(x)))
            block[:, :2] = gain * by[:, :2]
            block[:, 2 + 2 * i] = bending
            block[:, 3 + 2 * i] = gain * by[:, 2]
            left.append((model - record.acceleration)[after])
            rows.append(block[after])
        return np.concatenate(left), np.concatenate(rows)
