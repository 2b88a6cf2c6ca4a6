"""A mass on a spring and a damper, let go when their force returns to zero: by matrix exponential.

State (x, x') with x(0) = 0, x'(0) = v. The force is k x + c x'. Nothing here uses the closed form
in trigonometric functions: the state at t is expm(A t) (0, v), release is a root of the force in a
bracket found by marching, and the peak is where the rate of the force, C A expm(A t) (0, v), is 0.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq


@dataclass(frozen=True)
class Oscillator:
    mass: float
    stiffness: float
    damping: float
    speed: float

    @property
    def matrix(self) -> np.ndarray:
        return np.array([[0.0, 1.0], [-self.stiffness / self.mass, -self.damping / self.mass]])

    def state(self, time: float) -> np.ndarray:
        return expm(self.matrix * time) @ [0.0, self.speed]

    def force(self, time: float) -> float:
        return float(np.dot([self.stiffness, self.damping], self.state(time)))

    def force_rate(self, time: float) -> float:
        return float(np.dot([self.stiffness, self.damping], self.matrix @ self.state(time)))

    def _root(self, function, start: float) -> float:
        """The first sign change of `function` after `start`, by steps of 1 / (50 w)."""
        step = 0.02 * np.sqrt(self.mass / self.stiffness)
        a = start
        while function(a) * function(a + step) > 0.0:
            a += step
        return float(brentq(function, a, a + step, xtol=1e-18, rtol=1e-14))

    def contact_time(self) -> float:
        return self._root(self.force, 1e-9 * np.sqrt(self.mass / self.stiffness))

    def peak(self) -> tuple[float, float]:
        """Time and height of the largest force."""
        if self.force_rate(0.0) <= 0.0:
            return 0.0, self.force(0.0)
        time = self._root(self.force_rate, 0.0)
        return time, self.force(time)

    def restitution(self) -> float:
        return -float(self.state(self.contact_time())[1]) / self.speed
