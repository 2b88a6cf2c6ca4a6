"""A normal impact on a string-bed whose head is held rigidly: an ODE of 2 n + 2 states.

States: heights z_0..z_n-1 of the n string masses along the head's normal, their rates, and the
ball's height b and rate b'. Gravity is left out.

*Springs.* Spring s joins two ends whose heights differ by dz = z_j - z_i (a rim end has height
zero and does not move) and whose in-plane distance stays L0. Hence

    L = sqrt(L0^2 + dz^2),   L' = dz dz' / L,   T = T0 + k (L - L0) + c_s L'.

The tension pulls end j towards end i along the spring; its component along z is -T dz / L on j
and the opposite on i. A negative T is not cut off. Stored energy: T0 (L - L0) + k (L - L0)^2 / 2.

*Contact.* The ball meets mass p from the side of positive z. Its compression is x = z_p - b,

    N = kb x + cb x',   x' = z_p' - b',

N pushes the ball along +z and the mass along -z. At first touch, t = 0, the bed is at rest,
z = b = 0 and b' = -v0, so x = 0 and N = cb v0. Contact ends when N falls to zero or x falls to
zero, whichever is first; the integration stops there. N is not cut off inside the integrator:
the right-hand side stays smooth through the event, and N >= 0 everywhere before it.

Units: m, s, kg, N, N/m, N s/m.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp  # type: ignore[import-untyped, unused-ignore]
from scipy.optimize import minimize_scalar  # type: ignore[import-untyped, unused-ignore]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int_]


@dataclass(frozen=True)
class ClampedImpact:
    """One impact. Ends of springs are point indices 0..n-1, or -1 for the rim."""

    grid_xy: FloatArray  # (n, 2) points in the head, about the string-bed centre
    spring_i: IntArray  # (m,)
    spring_j: IntArray  # (m,)
    spring_k: FloatArray  # (m,) N/m
    spring_L0: FloatArray  # (m,) m
    T0: float  # N, the same in every spring
    string_mass: float  # kg, each of the n
    ball_mass: float
    kb: float
    cb: float
    point: int  # 0..n-1, the mass that is hit
    v0: float  # m/s towards -z
    string_damping: float = 0.0  # N s/m on each spring's elongation rate

    def __post_init__(self) -> None:
        """Refuse a grid that disagrees with the rest lengths between two masses."""
        both = (self.spring_i >= 0) & (self.spring_j >= 0)
        ends = self.grid_xy[self.spring_j[both]] - self.grid_xy[self.spring_i[both]]
        if not np.allclose(np.hypot(ends[:, 0], ends[:, 1]), self.spring_L0[both], atol=1e-9):
            raise ValueError("rest lengths of interior springs differ from the grid's spacing")


@dataclass(frozen=True)
class Result:
    """What the impact leaves behind; z and z_dot are the bed's state at release."""

    rebound_speed: float  # m/s along +z
    contact_time: float
    peak_force: float
    peak_time: float
    peak_compression: float  # of the ball, m
    z: FloatArray  # (n,)
    z_dot: FloatArray  # (n,)
    ball_z: float
    ball_z_dot: float
    state: FloatArray  # (2 n + 2,): z, z_dot, ball_z, ball_z_dot at release
    solution: Any  # callable t -> a state or states (2 n + 2, times) over the contact


def spring_forces(
    z: FloatArray,
    z_dot: FloatArray,
    i: IntArray,
    j: IntArray,
    k: FloatArray,
    L0: FloatArray,
    T0: float,
    damping: float = 0.0,
) -> FloatArray:
    """Force along z (n,) of all springs on the n masses."""
    height = np.append(z, 0.0)  # index -1, the rim, is the appended zero
    rate = np.append(z_dot, 0.0)
    dz = height[j] - height[i]
    length = np.sqrt(L0 * L0 + dz * dz)
    # L - L0 = dz^2 / (L + L0), without the cancellation at small dz
    tension = T0 + k * dz * dz / (length + L0) + damping * dz * (rate[j] - rate[i]) / length
    pull = tension * dz / length
    total = np.zeros(len(z) + 1)
    np.add.at(total, j, -pull)
    np.add.at(total, i, pull)
    return total[:-1]


def spring_energy(
    z: FloatArray, i: IntArray, j: IntArray, k: FloatArray, L0: FloatArray, T0: float
) -> float:
    """Energy (J) stored by the deflection; zero for a flat bed."""
    height = np.append(z, 0.0)
    dz = height[j] - height[i]
    stretch = dz * dz / (np.sqrt(L0 * L0 + dz * dz) + L0)
    return float(np.sum(T0 * stretch + 0.5 * k * stretch * stretch))


def contact_force(problem: ClampedImpact, y: FloatArray) -> FloatArray:
    """Kb x + cb x' (N), not cut off, for a state or states, one a column."""
    p, n = problem.point, len(problem.grid_xy)
    force: FloatArray = problem.kb * (y[p] - y[-2]) + problem.cb * (y[n + p] - y[-1])
    return force


def derivative(problem: ClampedImpact, y: FloatArray) -> FloatArray:
    """Rate of the states while the ball is in contact."""
    q = problem
    n = len(q.grid_xy)
    z, z_dot = y[:n], y[n:-2]
    force = spring_forces(
        z, z_dot, q.spring_i, q.spring_j, q.spring_k, q.spring_L0, q.T0, q.string_damping
    )
    normal = float(contact_force(q, y))
    force[q.point] -= normal
    rate = np.empty(2 * n + 2)
    rate[:n] = z_dot
    rate[n:-2] = force / q.string_mass
    rate[-2] = y[-1]
    rate[-1] = normal / q.ball_mass
    return rate


def simulate(
    problem: ClampedImpact, t_max: float = 0.1, rtol: float = 1e-11, atol: float = 1e-13
) -> Result:
    """Integrate from first touch to release."""

    def force_event(_t: float, y: FloatArray) -> float:
        return float(contact_force(problem, y))

    def compression_event(_t: float, y: FloatArray) -> float:
        return float(y[problem.point] - y[-2])

    for event in (force_event, compression_event):
        event.terminal = True  # type: ignore[attr-defined]
        event.direction = -1.0  # type: ignore[attr-defined]

    n = len(problem.grid_xy)
    start = np.zeros(2 * n + 2)
    start[-1] = -problem.v0
    run = solve_ivp(
        lambda _t, y: derivative(problem, y),
        (0.0, t_max),
        start,
        method="DOP853",
        rtol=rtol,
        atol=atol,
        dense_output=True,
        events=(force_event, compression_event),
    )
    if run.status != 1:
        raise RuntimeError(f"the ball did not leave within {t_max} s: {run.message}")
    release = float(run.t[-1])
    final: FloatArray = np.array(run.y[:, -1], dtype=np.float64)

    times = np.linspace(0.0, release, 4001)
    states = run.sol(times)
    peak_time, peak_force = _peak(
        times, contact_force(problem, states), lambda t: force_event(t, run.sol(t))
    )
    _, peak_compression = _peak(
        times, states[problem.point] - states[-2], lambda t: compression_event(t, run.sol(t))
    )
    return Result(
        rebound_speed=float(final[-1]),
        contact_time=release,
        peak_force=peak_force,
        peak_time=peak_time,
        peak_compression=peak_compression,
        z=final[:n].copy(),
        z_dot=final[n:-2].copy(),
        ball_z=float(final[-2]),
        ball_z_dot=float(final[-1]),
        state=final,
        solution=run.sol,
    )


def _peak(times: FloatArray, values: FloatArray, function: Any) -> tuple[float, float]:
    """Time and value of the maximum: the largest sample, then refined around it."""
    n = int(np.argmax(values))
    low, high = times[max(n - 1, 0)], times[min(n + 1, len(times) - 1)]
    best = minimize_scalar(
        lambda t: -function(t), bounds=(low, high), method="bounded", options={"xatol": 1e-12}
    )
    if -best.fun > values[n]:
        return float(best.x), float(-best.fun)
    return float(times[n]), float(values[n])
