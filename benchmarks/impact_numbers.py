"""The numbers of one normal impact at first touch, read from the package's parameter files.

For the two programs that `against_others` compares with the package: they share its data, none of
its code for motion or force.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_racket.laws.contact import ball_constants
from drake_racket.parameters.scenario import Scenario
from drake_racket.plant.string_bed import string_bed_model


@dataclass(frozen=True)
class Numbers:
    """SI units; points are 0-based; inertias are about a part's own centre of mass, (x, y, z)."""

    handle_mass: float
    handle_length: float
    handle_com: float  # from the butt
    handle_inertia: NDArray[np.float64]
    head_mass: float
    head_com: float  # from the throat joint
    head_inertia: NDArray[np.float64]
    k_z: float
    c_z: float
    k_y: float
    c_y: float
    points: NDArray[np.float64]  # (9, 2) x, y from the throat joint
    string_mass: float
    incidence: NDArray[np.float64]  # (24, 9)
    ends: tuple[tuple[int, int], ...]  # 24: point, point or -1 for the rim
    spring_k: NDArray[np.float64]
    lengths: NDArray[np.float64]
    initial_tension: float
    ball_mass: float
    ball_velocity: NDArray[np.float64]
    point: int
    kb: float
    cb: float
    mu: float
    sliding_speed_scale: float


def numbers_of(scenario: Scenario) -> Numbers:
    """The numbers of a free racket's scenario whose ball meets its point along the normal."""
    racket, ball = scenario.load_racket(), scenario.load_ball()
    bed = string_bed_model(racket)
    factors = np.append(bed.rim_factors, 1.0)
    speeds = (ball.speed_low.value, ball.speed_high.value)
    point = scenario.point_number()
    velocity = scenario.ball_velocity()
    handle, head = racket.handle, racket.head
    k_z, c_z = racket.throat_joint.in_plane()
    k_y, c_y = racket.throat_joint.out_of_plane()
    return Numbers(
        handle_mass=handle.mass.value,
        handle_length=handle.length.value,
        handle_com=handle.com.value,
        handle_inertia=_moments(handle),
        head_mass=head.mass.value,
        head_com=head.com.value,
        head_inertia=_moments(head),
        k_z=k_z,
        c_z=c_z,
        k_y=k_y,
        c_y=c_y,
        points=np.array([racket.point_in_head(i) for i in racket.bed_topology().points]),
        string_mass=racket.string_mass(),
        incidence=bed.topology.incidence,
        ends=tuple((int(i), int(j)) for i, j in bed.topology.ends.T),
        spring_k=bed.stiffness[bed.stiffness_index] * factors[bed.rim_factor_index],
        lengths=bed.lengths,
        initial_tension=bed.initial_tension,
        ball_mass=ball.mass.value,
        ball_velocity=velocity,
        point=point - 1,
        kb=ball_constants(
            -velocity[2], *speeds, ball.stiffness_low.value, ball.stiffness_growth.value
        ),
        cb=ball_constants(-velocity[2], *speeds, ball.damping_low.value, ball.damping_growth.value),
        mu=racket.friction_coefficients()[point - 1],
        sliding_speed_scale=ball.sliding_speed_scale.value,
    )


def _moments(part) -> NDArray[np.float64]:
    return np.array(
        [part.moi_longitudinal.value, part.moi_transverse.value, part.moi_frontal.value]
    )
