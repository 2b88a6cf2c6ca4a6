"""The oracles checked against themselves: closed forms, conservation laws, a second derivation.

The second derivation of the free racket is ``particles``: d'Alembert's principle on particles,
differentiated numerically from their positions.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh, expm  # type: ignore[import-untyped, unused-ignore]

from .clamped_impact import ClampedImpact, FloatArray, derivative, simulate, spring_energy
from .free_impact import simulate as simulate_free
from .free_racket import (
    Accelerations,
    FreeRacketParams,
    FreeRacketState,
    accelerations,
    contact,
    momenta,
    potential_energy,
    rotation_HB,
    skew,
)
from .particles import contact_numbers, particle_accelerations
from .two_body import free_free_frequency, handle_clamped_frequency, reduced_inertia

HANDLE, HEAD = (0.1335, 0.356, 0.11365), (0.1605, 0.15032)
I_HANDLE, I_HEAD = np.array([4e-5, 0.00172, 0.00173]), np.array([0.00137, 0.00331, 0.00465])
STEP, A, B = 0.0685, 0.164, 0.123
GRID = np.array([[x, y] for x in (STEP, 0.0, -STEP) for y in (STEP, 0.0, -STEP)])
G = np.array([0.3, -9.0, 2.0])


def _springs() -> dict[str, Any]:
    """Make some bed: three rows and three columns, each rim - mass - mass - mass - rim."""
    i, j, k, L0 = [], [], [], []
    rng = np.random.default_rng(3)
    for line in [*np.arange(9).reshape(3, 3), *np.arange(9).reshape(3, 3).T]:
        for a, b in zip([-1, *line], [*line, -1], strict=True):
            x, y = GRID[max(a, b) if min(a, b) < 0 else a]
            along_x = line[1] - line[0] == 3
            rim = A * np.sqrt(1 - (y / B) ** 2) - abs(x) if along_x else 0.0
            rim = rim if along_x else B * np.sqrt(1 - (x / A) ** 2) - abs(y)
            i.append(a)
            j.append(b)
            L0.append(rim if min(a, b) < 0 else STEP)
            k.append(rng.uniform(1.5e5, 8e5))
    return {
        "spring_i": np.array(i), "spring_j": np.array(j),
        "spring_k": np.array(k), "spring_L0": np.array(L0),
    }  # fmt: skip


def _clamped(**change: Any) -> ClampedImpact:
    problem = ClampedImpact(
        grid_xy=GRID, T0=648.2, string_mass=0.0149 / 9, ball_mass=0.059, kb=4.5e4, cb=14.0,
        point=4, v0=18.0, **_springs(),
    )  # fmt: skip
    return replace(problem, **change)


def _params(**change: Any) -> FreeRacketParams:
    params = FreeRacketParams(
        handle_mass=HANDLE[0], handle_length=HANDLE[1], handle_com=HANDLE[2],
        handle_inertia=I_HANDLE, head_mass=HEAD[0], head_com=HEAD[1], head_inertia=I_HEAD,
        k_z=1650.0, c_z=0.09, k_y=910.0, c_y=0.03, gsc=0.155, grid_xy=GRID,
        string_mass=0.0149 / 9, T0=648.2, ball_mass=0.059, kb=4.5e4, cb=14.0, mu=0.35,
        contact_index=2, **_springs(),
    )  # fmt: skip
    return replace(params, **change)


def _random_state(seed: int, in_contact: bool = False) -> FreeRacketState:
    rng = np.random.default_rng(seed)
    R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    R = R * np.linalg.det(R)
    state = FreeRacketState(
        R_WH=R, p_WHo=rng.normal(size=3), theta_z=rng.normal(0, 0.1),
        theta_y=rng.normal(0, 0.1), z=rng.normal(0, 0.004, 9), p_WQ=rng.normal(size=3),
        w_WH=rng.normal(0, 15, 3), v_WHo=rng.normal(0, 8, 3), theta_z_dot=rng.normal(0, 10),
        theta_y_dot=rng.normal(0, 10), z_dot=rng.normal(0, 4, 9), v_WQ=rng.normal(0, 20, 3),
        in_contact=in_contact, offset=(0.002, -0.003),
    )  # fmt: skip
    R_WB = R @ rotation_HB(state.theta_z, state.theta_y)
    at = np.array([0.155 + GRID[2, 0] + 0.01, GRID[2, 1] - 0.007, state.z[2] - 0.012])
    return replace(state, p_WQ=state.p_WHo + R @ [HANDLE[1], 0, 0] + R_WB @ at)


def _pressed(seed: int, params: FreeRacketParams) -> FreeRacketState:
    """Make a random state with the ball compressed and still approaching, so that N is positive."""
    state = _random_state(seed, in_contact=True)
    n = (state.R_WH @ rotation_HB(state.theta_z, state.theta_y))[:, 2]
    return replace(state, v_WQ=state.v_WQ + (contact(params, state).x_dot - 5.0) * n)


def _vector(a: Accelerations) -> FloatArray:
    vector: FloatArray = np.r_[
        a.alpha_WH, a.a_WHo, a.theta_z_ddot, a.theta_y_ddot, a.z_ddot, a.a_WQ
    ]
    return vector


# two_body


def test_two_body_frequencies_of_the_tour_racket() -> None:
    out = (0.1335, 0.356, 0.11365, 0.00172, 0.1605, 0.15032, 0.00331, 910.0)
    assert free_free_frequency(*HANDLE, 0.00173, *HEAD, 0.00465, 1650.0) == pytest.approx(
        154.6224, abs=5e-5
    )
    assert free_free_frequency(*out) == pytest.approx(128.5411, abs=5e-5)


def test_two_body_equals_the_eigenvalue_problem() -> None:
    m1, l1, c1, m2, c2, k = *HANDLE, *HEAD, 1650.0
    rows = np.array([[1, -(l1 - c1), 0], [1, 0, c2], [0, 1, 0], [0, 0, 1]], dtype=float)
    M = rows.T @ np.diag([m1, m2, 0.00173, 0.00465]) @ rows  # coordinates y, p1, p2
    K = k * np.array([[0.0, 0, 0], [0, 1, -1], [0, -1, 1]])
    top = np.sqrt(eigh(K, M, eigvals_only=True)[-1]) / (2 * np.pi)
    assert free_free_frequency(m1, l1, c1, 0.00173, m2, c2, 0.00465, k) == pytest.approx(top, 1e-12)
    heavy = free_free_frequency(1e12, l1, c1, 1e12, m2, c2, 0.00465, k)
    assert handle_clamped_frequency(m2, c2, 0.00465, k) == pytest.approx(heavy, 1e-9)


# clamped_impact


@pytest.mark.parametrize("point", [0, 4, 7])
def test_clamped_energy(point: int) -> None:
    problem = _clamped(point=point, v0=33.0)
    q, end = problem, simulate(problem)
    bed = spring_energy(end.z, q.spring_i, q.spring_j, q.spring_k, q.spring_L0, q.T0)
    left = 0.5 * q.string_mass * end.z_dot @ end.z_dot + bed + 0.5 * q.ball_mass * end.ball_z_dot**2
    left += 0.5 * q.kb * (end.z[point] - end.ball_z) ** 2
    nodes, weights = np.polynomial.legendre.leggauss(400)
    y = end.solution(0.5 * end.contact_time * (nodes + 1.0))
    lost = 0.5 * end.contact_time * q.cb * weights @ (y[9 + point] - y[19]) ** 2
    assert left + lost == pytest.approx(0.5 * q.ball_mass * q.v0**2, rel=1e-9)
    impulse = 0.5 * end.contact_time * weights @ (q.kb * (y[point] - y[18]) + q.cb * (
        y[9 + point] - y[19]))  # fmt: skip
    assert impulse == pytest.approx(q.ball_mass * (end.rebound_speed + q.v0), rel=1e-9)
    assert end.peak_force >= q.cb * q.v0


def test_clamped_small_impact_equals_the_matrix_exponential() -> None:
    problem = _clamped(v0=1e-4)
    end = simulate(problem, atol=1e-19)
    system = np.column_stack([derivative(problem, 1e-9 * e) / 1e-9 for e in np.eye(20)])
    start = np.r_[np.zeros(19), -1e-4]
    assert np.allclose(expm(system * end.contact_time) @ start, end.state, rtol=1e-7, atol=1e-14)


def test_clamped_elastic_ball_leaves_at_zero_compression() -> None:
    end = simulate(_clamped(cb=0.0))
    assert end.ball_z == pytest.approx(end.z[4], abs=1e-12)


# free_racket


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("friction", ["velocity", "displacement"])
@pytest.mark.parametrize("reaction_at", ["ball", "string_mass"])
def test_free_racket_equals_the_particle_derivation(
    seed: int, friction: str, reaction_at: str
) -> None:
    par = _params(friction=friction, reaction_at=reaction_at, string_damping=0.7)
    st = _pressed(seed, par)
    a = accelerations(par, st, G)
    place, rate, R_WB = contact_numbers(par, st)
    assert a.x == pytest.approx(-place[2], rel=1e-12)
    assert a.x_dot == pytest.approx(-rate[2], rel=1e-12)
    assert pytest.approx(par.kb * a.x + par.cb * a.x_dot, rel=1e-12) == a.N
    assert a.N > 100.0
    slip = rate[:2] if friction == "velocity" else place[:2] - st.offset
    slip = slip / np.hypot(np.hypot(*slip), par.eps_v if friction == "velocity" else par.eps_d)
    on_ball = a.N * R_WB @ np.r_[-par.mu * slip, 1.0]
    other = particle_accelerations(par, st, G, on_ball)
    for part in (slice(0, 3), slice(3, 6), slice(6, 8), slice(8, 17), slice(17, 20)):
        assert np.abs(_vector(a)[part] - other[part]).max() < 1e-9 * np.abs(other[part]).max()


def test_free_motion_conserves_energy_and_momentum() -> None:
    par = _params(c_z=0.0, c_y=0.0)
    run = simulate_free(par, _random_state(11), 0.01, samples=6, rtol=1e-13, atol=1e-14)
    first = momenta(par, run.states[0])
    energy = first.kinetic_energy + potential_energy(par, run.states[0])
    for state in run.states[1:]:
        now = momenta(par, state)
        assert now.kinetic_energy + potential_energy(par, state) == pytest.approx(energy, 1e-10)
        for a, b in ((now.linear, first.linear), (now.angular, first.angular)):
            assert np.linalg.norm(a - b) < 1e-10 * np.linalg.norm(b)
    assert np.allclose(run.final.R_WH.T @ run.final.R_WH, np.eye(3), atol=1e-11)


def test_fall_conserves_energy_with_gravity_and_joint_damping_loses_it() -> None:
    for c, sign in ((0.0, 0), (0.09, -1)):
        par = _params(c_z=c, c_y=c)
        run = simulate_free(par, _random_state(5), 0.003, G, samples=2, rtol=1e-13, atol=1e-14)
        e = [momenta(par, s).kinetic_energy + potential_energy(par, s, G) for s in run.states]
        change = (e[1] - e[0]) / e[0]
        assert abs(change) < 1e-10 if sign == 0 else change < -1e-6


@pytest.mark.parametrize("friction", ["velocity", "displacement"])
@pytest.mark.parametrize("reaction_at", ["ball", "string_mass"])
def test_contact_conserves_momentum(friction: str, reaction_at: str) -> None:
    """Rates of the momenta along the accelerations; the couple p x f is what string_mass leaves."""
    par = _params(friction=friction, reaction_at=reaction_at, c_z=0.0, c_y=0.0)
    st = _pressed(2, par)
    a = accelerations(par, st)
    place, _, R_WB = contact_numbers(par, st)
    force = a.N * R_WB[:, 2] + a.F

    def along(t: float) -> FloatArray:  # a path with these velocities and accelerations at t = 0
        moved = replace(
            st,
            R_WH=expm(skew(t * st.w_WH + t * t / 2 * a.alpha_WH)) @ st.R_WH,
            p_WHo=st.p_WHo + t * st.v_WHo + t * t / 2 * a.a_WHo,
            theta_z=st.theta_z + t * st.theta_z_dot + t * t / 2 * a.theta_z_ddot,
            theta_y=st.theta_y + t * st.theta_y_dot + t * t / 2 * a.theta_y_ddot,
            z=st.z + t * st.z_dot + t * t / 2 * a.z_ddot,
            p_WQ=st.p_WQ + t * st.v_WQ + t * t / 2 * a.a_WQ,
            w_WH=st.w_WH + t * a.alpha_WH,
            v_WHo=st.v_WHo + t * a.a_WHo,
            theta_z_dot=st.theta_z_dot + t * a.theta_z_ddot,
            theta_y_dot=st.theta_y_dot + t * a.theta_y_ddot,
            z_dot=st.z_dot + t * a.z_ddot,
            v_WQ=st.v_WQ + t * a.a_WQ,
        )
        total = momenta(par, moved)
        return np.concatenate([total.linear, total.angular])

    h = 1e-5
    rate = (8 * (along(h) - along(-h)) - (along(2 * h) - along(-2 * h))) / (12 * h)
    couple = np.cross(R_WB @ place, force) if reaction_at == "string_mass" else np.zeros(3)
    assert np.abs(rate[:3]).max() < 1e-7 * np.linalg.norm(force)
    assert np.abs(rate[3:] - couple).max() < 1e-7 * np.linalg.norm(force)
    assert reaction_at == "ball" or np.linalg.norm(couple) > 1.0


def _at_touch(par: FreeRacketParams, velocity: list[float], offset: list[float]) -> FreeRacketState:
    x, y = par.grid_xy[par.contact_index]
    zero = np.zeros(3)
    place = np.array([par.handle_length + par.gsc + x + offset[0], y + offset[1], 0.0])
    return FreeRacketState(
        R_WH=np.eye(3), p_WHo=zero, theta_z=0.0, theta_y=0.0, z=np.zeros(9), p_WQ=place,
        w_WH=zero, v_WHo=zero, theta_z_dot=0.0, theta_y_dot=0.0, z_dot=np.zeros(9),
        v_WQ=np.array(velocity), in_contact=True, offset=(offset[0], offset[1]),
    )  # fmt: skip


def test_whole_impact_conserves_what_it_should() -> None:
    """Elastic, frictionless, reaction at the ball: energy and both momenta over the impact."""
    par = _params(c_z=0.0, c_y=0.0, cb=0.0, mu=0.0)
    run = simulate_free(par, _at_touch(par, [3.0, -4.0, -25.0], [0.01, 0.005]), 0.02, samples=2)
    assert run.released
    a, b = momenta(par, run.states[0]), momenta(par, run.final)
    energy = b.kinetic_energy + potential_energy(par, run.final)
    assert energy == pytest.approx(a.kinetic_energy, rel=1e-9)
    assert np.linalg.norm(a.linear - b.linear) < 1e-9 * np.linalg.norm(a.linear)
    assert np.linalg.norm(a.angular - b.angular) < 1e-9 * np.linalg.norm(a.angular)


def test_very_heavy_racket_is_the_clamped_head() -> None:
    huge = 1e9
    par = _params(
        handle_mass=huge, head_mass=huge, handle_inertia=huge * np.ones(3),
        head_inertia=huge * np.ones(3), mu=0.0,
    )  # fmt: skip
    run = simulate_free(par, _at_touch(par, [0.0, 0.0, -18.0], [0.0, 0.0]), 0.02, samples=2)
    clamped = simulate(_clamped(point=2))
    assert run.t[-1] == pytest.approx(clamped.contact_time, rel=1e-8)
    assert run.final.v_WQ[2] == pytest.approx(clamped.rebound_speed, rel=1e-8)
    assert np.allclose(run.final.z, clamped.z, rtol=1e-7, atol=1e-11)


@pytest.mark.parametrize("joint", ["theta_z", "theta_y"])
def test_bending_inertia_is_that_of_two_bodies(joint: str) -> None:
    par = _params(string_mass=1e-14)
    angle = 1e-7
    rest = _at_touch(par, [0.0] * 3, [0.0] * 2)
    st = replace(rest, in_contact=False, **{joint: angle})  # type: ignore[arg-type]
    a = accelerations(par, st)
    axis, k = (2, par.k_z) if joint == "theta_z" else (1, par.k_y)
    got = a.theta_z_ddot if joint == "theta_z" else a.theta_y_ddot
    J = reduced_inertia(*HANDLE, I_HANDLE[axis], *HEAD, I_HEAD[axis])
    assert got == pytest.approx(-k * angle / J, rel=1e-9)
