"""Computes torques at the ends of joints' ranges. `limbs.limits` has the LeafSystem.

Law, for a joint of position q and velocity v with the range [lower, upper], with s the angle by
which it is beyond its upper end (the lower end likewise, with the signs turned):

    s = max(q - upper, 0),    torque = -k s max(1 + d v, 0)

A one-sided spring with the damping of Hunt & Crossley (1975), J. Appl. Mech. 42:440-445: zero
inside the range, continuous at its end, and never pulling back towards the limit. The spring
holds k s^2 / 2; the rest of the work is lost. Joints have soft stops of ligament and muscle; the
shipped stiffnesses k and the damping d are inferred (data/upper_limb.yaml says from what).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drake_racket.laws.compilation import compilable


@compilable
def _beyond(q: Any, lower: Any, upper: Any) -> tuple[Any, Any]:
    """Angles (rad) beyond the lower and the upper end, 0 inside."""
    zero = 0.0 * q
    return np.maximum(lower - q, zero), np.maximum(q - upper, zero)


@compilable
def limit_torques(q: Any, v: Any, lower: Any, upper: Any, stiffness: Any, damping: Any) -> Any:
    """Computes the limits' torques (N m); arguments and result have one entry per joint."""
    below, above = _beyond(q, lower, upper)
    zero = 0.0 * v
    up = stiffness * below * np.maximum(1.0 - damping * v, zero)
    return up - stiffness * above * np.maximum(1.0 + damping * v, zero)


@compilable
def limit_energies(q: Any, lower: Any, upper: Any, stiffness: Any) -> Any:
    """Gives the energy (J) that each joint's limits hold."""
    below, above = _beyond(q, lower, upper)
    return 0.5 * stiffness * (below * below + above * above)


@compilable
def limit_losses(q: Any, v: Any, lower: Any, upper: Any, stiffness: Any, damping: Any) -> Any:
    """Gives power (W) lost at each joint's limits: what the torque takes, less the spring's."""
    below, above = _beyond(q, lower, upper)
    torque = limit_torques(q, v, lower, upper, stiffness, damping)
    return -torque * v - stiffness * (above - below) * v
