"""The free racket and the ball in MuJoCo: engine joints and tendons, contact in a callback.

The handle is a free body, the head hangs on two hinges (z, then y) with stiffness and damping, nine
string masses slide on the head, 24 spatial tendons are the springs. A tendon pulls with
k (L - springlength), which is T0 + k (L - L0) with springlength = L0 - T0 / k > 0. The ball slides
along the three world axes. The contact law is a passive-force callback, which RK4 calls at every
stage: one Python call into a function that numba compiles where it is installed, as the package
does with its own law. MuJoCo's contacts and constraints are off.

MuJoCo asks for a rotational inertia of every moving body, which the point masses do not have. They
get 2e-15 kg m^2, just above the least that it accepts, which moves the rebound velocity by less
than 1e-11 m/s.

The step is fixed, and a force that ends within a step costs the method its order. The step in
which the ball leaves is therefore taken again up to the zero of the force.
"""

from __future__ import annotations

import mujoco
import numpy as np
from impact_numbers import Numbers
from numpy.typing import NDArray
from scipy.optimize import brentq

from drake_racket.laws.compilation import compiled

POINT_INERTIA = 2e-15  # kg m^2


def model_xml(n: Numbers) -> str:
    """The MJCF of racket and ball."""

    def numbers(*values: float) -> str:
        return " ".join(f"{v:.17g}" for v in values)

    masses = "\n".join(
        f'<body name="s{i}" pos="{numbers(x, y, 0.0)}"><joint type="slide" axis="0 0 1"/>'
        f'<inertial pos="0 0 0" mass="{numbers(n.string_mass)}"'
        f' diaginertia="{numbers(*[POINT_INERTIA] * 3)}"/><site name="p{i}"/></body>'
        for i, (x, y) in enumerate(n.points)
    )
    rim, tendons = [], []
    for k, (i, j) in enumerate(n.ends):
        other = f"p{j}"
        if j < 0:
            other = f"r{k}"
            rim.append(f'<site name="{other}" pos="{numbers(*_rim_end(n, k, i), 0.0)}"/>')
        spring_length = n.lengths[k] - n.initial_tension / n.spring_k[k]
        assert spring_length > 0.0
        tendons.append(
            f'<spatial stiffness="{numbers(n.spring_k[k])}"'
            f' springlength="{numbers(spring_length)}">'
            f'<site site="p{i}"/><site site="{other}"/></spatial>'
        )
    ball = numbers(n.handle_length + n.points[n.point, 0], n.points[n.point, 1], 0.0)
    rim_sites, tendon_list = "\n".join(rim), "\n".join(tendons)
    return f"""<mujoco>
<compiler angle="radian" inertiafromgeom="false"/>
<option integrator="RK4" gravity="0 0 0"><flag contact="disable" constraint="disable"/></option>
<worldbody>
<body name="handle"><freejoint/>
<inertial pos="{numbers(n.handle_com, 0.0, 0.0)}" mass="{numbers(n.handle_mass)}"
 diaginertia="{numbers(*n.handle_inertia)}"/>
<body name="head" pos="{numbers(n.handle_length, 0.0, 0.0)}">
<joint type="hinge" axis="0 0 1" stiffness="{numbers(n.k_z)}" damping="{numbers(n.c_z)}"/>
<joint type="hinge" axis="0 1 0" stiffness="{numbers(n.k_y)}" damping="{numbers(n.c_y)}"/>
<inertial pos="{numbers(n.head_com, 0.0, 0.0)}" mass="{numbers(n.head_mass)}"
 diaginertia="{numbers(*n.head_inertia)}"/>
{rim_sites}
{masses}
</body></body>
<body name="ball" pos="{ball}">
<joint type="slide" axis="1 0 0"/>
<joint type="slide" axis="0 1 0"/>
<joint type="slide" axis="0 0 1"/>
<inertial pos="0 0 0" mass="{numbers(n.ball_mass)}"
 diaginertia="{numbers(*[POINT_INERTIA] * 3)}"/>
</body>
</worldbody>
<tendon>
{tendon_list}
</tendon>
</mujoco>"""


def _rim_end(n: Numbers, spring: int, point: int) -> tuple[float, float]:
    """Where a rim spring ends: from its mass away from the centre, along x (a main) or y."""
    x, y = n.points[point]
    column, row = 1 - point % 3, 1 - point // 3
    if spring < 12:  # the mains come first, tip before throat
        return x + (n.lengths[spring] if row > 0 else -n.lengths[spring]), y
    return x, y + (n.lengths[spring] if column > 0 else -n.lengths[spring])


@compiled
def _contact(x_s, r_s, v_s, com, x_q, v_q, cdof, dofs, constants, out):
    """Adds the contact's generalized forces to `out`; returns kb x + cb x'.

    x_s, r_s: the string mass and its axes (row by row); v_s: its spatial velocity about `com` (the
    racket's, as MuJoCo has it); x_q, v_q: the ball; cdof: motion axes about `com`; dofs: those of
    the string mass, then three of the ball.
    """
    kb, cb, mu, scale = constants
    d0, d1, d2 = x_q[0] - com[0], x_q[1] - com[1], x_q[2] - com[2]
    u0 = v_q[0] - v_s[3] - (v_s[1] * d2 - v_s[2] * d1)
    u1 = v_q[1] - v_s[4] - (v_s[2] * d0 - v_s[0] * d2)
    u2 = v_q[2] - v_s[5] - (v_s[0] * d1 - v_s[1] * d0)
    n0, n1, n2 = r_s[2], r_s[5], r_s[8]
    compression = -(n0 * (x_q[0] - x_s[0]) + n1 * (x_q[1] - x_s[1]) + n2 * (x_q[2] - x_s[2]))
    rate = -(n0 * u0 + n1 * u1 + n2 * u2)
    raw = kb * compression + cb * rate
    t0, t1, t2 = u0 + rate * n0, u1 + rate * n1, u2 + rate * n2
    share = -mu * raw / (t0 * t0 + t1 * t1 + t2 * t2 + scale * scale) ** 0.5
    f0, f1, f2 = raw * n0 + share * t0, raw * n1 + share * t1, raw * n2 + share * t2
    m0, m1, m2 = d1 * f2 - d2 * f1, d2 * f0 - d0 * f2, d0 * f1 - d1 * f0
    for i in range(9):
        a = cdof[dofs[i]]
        out[dofs[i]] -= a[0] * m0 + a[1] * m1 + a[2] * m2 + a[3] * f0 + a[4] * f1 + a[5] * f2
    out[dofs[9]] += f0
    out[dofs[10]] += f1
    out[dofs[11]] += f2
    return raw


class MujocoImpact:
    """One normal impact on a racket at rest, from first touch on."""

    def __init__(self, numbers: Numbers) -> None:
        self.numbers = numbers
        self.model = mujoco.MjModel.from_xml_string(model_xml(numbers))
        self.data = data = mujoco.MjData(self.model)
        string, ball = (
            mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, name)
            for name in (f"s{numbers.point}", "ball")
        )
        slide = self.model.body_dofadr[string]
        self.ball = slice(int(self.model.body_dofadr[ball]), int(self.model.body_dofadr[ball]) + 3)
        dofs = np.array([*range(8), slide, *range(self.ball.start, self.ball.stop)])
        constants = (numbers.kb, numbers.cb, numbers.mu, numbers.sliding_speed_scale)
        # views of MuJoCo's memory, taken once
        self.arguments = (
            data.xpos[string],
            data.xmat[string],
            data.cvel[string],
            data.subtree_com[self.model.body_rootid[string]],
            data.xpos[ball],
            data.qvel[self.ball],
            data.cdof,
            dofs,
            constants,
            data.qfrc_passive,
        )
        self.unused = np.zeros(self.model.nv)
        self.raw = 0.0  # kb x + cb x' at the last stage
        self.touching = True

    def _callback(self, _model: mujoco.MjModel, _data: mujoco.MjData) -> None:
        if self.touching:
            self.raw = _contact(*self.arguments)

    def run(self, step: float, end: float) -> NDArray[np.float64]:
        """Rebound velocity of the ball, from touch to `end`."""
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        data.qvel[self.ball] = self.numbers.ball_velocity
        model.opt.timestep = step
        self.touching = True
        mujoco.set_mjcb_passive(self._callback)
        try:
            for _ in range(round(end / step)):
                if not self.touching:
                    mujoco.mj_step(model, data)
                    continue
                position, velocity = data.qpos.copy(), data.qvel.copy()
                mujoco.mj_step(model, data)
                if self.raw <= 0.0:
                    self._release(position, velocity, step)
        finally:
            mujoco.set_mjcb_passive(None)
        return data.qvel[self.ball].copy()

    def _release(
        self, position: NDArray[np.float64], velocity: NDArray[np.float64], step: float
    ) -> None:
        """Takes the step again: to the zero of the force, and from there without contact."""
        model, data = self.model, self.data

        def force_after(part: float) -> float:
            data.qpos[:], data.qvel[:] = position, velocity
            model.opt.timestep = part
            mujoco.mj_step(model, data)
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_comVel(model, data)
            return _contact(*self.arguments[:-1], self.unused)

        part = brentq(force_after, 0.0, 1.5 * step, xtol=1e-6 * step)
        force_after(part)
        self.touching = False
        model.opt.timestep = step - part
        mujoco.mj_step(model, data)
        model.opt.timestep = step
