"""Computes the force of a ball on a rigid plate and its exact derivatives.

`rigs.force_plate.force` has the law and its closed form. With a = cb / (2 m), g = kb - cb a and
q = kb / m - a^2 (negative if overdamped),

    N = v exp(-a t) (cb C + g S),   C = cos(sqrt(q) t),   S = sin(sqrt(q) t) / sqrt(q),

where t counts from touch. C and S are smooth functions of q through 0:

    dC/dq = -t S / 2,   dS/dq = (t C - S) / (2 q),

so that N has derivatives by kb, cb, v and the time of touch everywhere inside the contact. Here N
is not cut off: a fit takes only samples surely in contact, and stays smooth.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SERIES_BELOW = 0.05
"""Of q t^2, below which (t C - S) / (2 q) is summed as a series: its terms cancel there."""


def plate_force(
    time: Array, *, mass: float, stiffness: float, damping: float, speed: float
) -> tuple[Array, Array]:
    """Gives the force (N) and its derivatives, without the end of contact.

    Args:
        time: (n,) s from touch; negative times continue the formula backwards.
        mass: kg.  stiffness: N/m.  damping: N s/m.  speed: m/s, all positive (damping: or 0).

    Returns:
        (n,) force, and (n, 4) derivatives by stiffness (m), damping (m/s), speed (N s/m) and the
        time of touch (N/s).

    """
    a = 0.5 * damping / mass
    g, q = stiffness - damping * a, stiffness / mass - a * a
    c, s, s_q = _swing(time, q)
    c_q = -0.5 * time * s
    decay = speed * np.exp(-a * time)
    swing = damping * c + g * s
    by_q = damping * c_q + g * s_q
    by_stiffness = s + by_q / mass
    # by cb: through a in the exponent, cb and g = kb - cb^2 / 2m in the swing, and q
    by_damping = -0.5 * time / mass * swing + c - 2.0 * a * s - a / mass * by_q
    by_time = -a * swing - damping * q * s + g * c
    columns = [by_stiffness, by_damping, swing / speed, -by_time]
    return decay * swing, decay[:, np.newaxis] * np.stack(columns, axis=1)


def _swing(t: Array, q: float) -> tuple[Array, Array, Array]:
    """C, S and dS/dq at the times t."""
    y = q * t * t
    angle = np.sqrt(y.astype(complex))
    c = np.cos(angle).real
    sinc = np.sinc(angle / np.pi).real
    small = np.abs(y) < SERIES_BELOW
    safe = np.where(small, 1.0, y)
    # (cos x - sin x / x) / (2 x^2), x^2 = y
    series = -1.0 / 6.0 + y * (1.0 / 60.0 - y * (1.0 / 1680.0 - y / 90720.0))
    return c, t * sinc, t**3 * np.where(small, series, 0.5 * (c - sinc) / safe)
