"""Gives a contact's system its numbers and bodies, from the parameter files and the plant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drake_racket.io.errors import InputError
from drake_racket.laws.phases import ContactModel
from drake_racket.laws.surface import CONTACTS, SurfaceModel
from drake_racket.parameters.ball import BallParameters, surface_of
from drake_racket.parameters.racket import RacketParameters
from drake_racket.plant.ball import Ball, ball_law
from drake_racket.plant.racket import Racket
from drake_racket.plant.string_bed import string_coordinates
from drake_racket.plant.systems.surface_contact import SurfaceBodies


def contact_model(
    racket: RacketParameters,
    ball: BallParameters,
    point: int,
    friction_reading: str,
    reaction_point: str,
) -> ContactModel:
    """Gives the numbers of the parameter files, for the BallContact system."""
    bed = racket.string_bed
    return ContactModel(
        ball=ball_law(ball),
        friction=tuple(racket.friction_coefficients()),
        scales=(ball.sliding_speed_scale.value, ball.sliding_distance_scale.value),
        grid=bed.spacing.value * racket.bed_topology().places,
        rim=(bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value),
        point=point,
        by_displacement=friction_reading == "displacement",
        reaction_at_ball=reaction_point == "ball",
    )


def surface_model(racket: RacketParameters, ball: BallParameters) -> SurfaceModel:
    """Gives the numbers of the parameter files, for the SurfaceContact system.

    Raises:
        InputError: the ball has no numbers of its surface.

    """
    bed, surface = racket.string_bed, surface_of(ball)
    return SurfaceModel(
        ball=ball_law(ball),
        friction=tuple(racket.friction_coefficients()),
        surface=(
            ball.radius.value,
            surface.flattening.value,
            surface.tangential_stiffness.value,
            surface.tangential_damping.value,
            0.0,
        ),
        grid=bed.spacing.value * racket.bed_topology().places,
        rim=(bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value),
    )


def element_model(racket: RacketParameters, ball: BallParameters, point: int) -> SurfaceModel:
    """Gives the numbers of friction reading `element`: the paper's ball, for the same system.

    Args:
        point: number of the string mass that it meets, or 0 for the nearest at touch.

    Raises:
        InputError: the ball has no numbers of its surface.

    """
    found = surface_model(racket, ball)
    _, _, kt, ct, _ = found.surface
    return replace(found, surface=(0.0, 0.0, kt, ct, float(point or -1)))


def surface_bodies(racket: Racket, ball: Ball) -> SurfaceBodies:
    """Tells where a bed and a ball are on their finalized plant."""
    first = racket.string_joints[0].frame_on_parent()
    X_HS = first.GetFixedPoseInBodyFrame()
    bed = racket.parameters.string_bed
    x, y = bed.spacing.value * racket.parameters.bed_topology().places[0]
    axes = X_HS.rotation().matrix()
    at, count = string_coordinates(racket), len(racket.string_joints)
    return SurfaceBodies(
        ball=int(ball.body.index()),
        head=int(first.body().index()),
        strings=tuple(int(b.index()) for b in racket.string_masses),
        positions=at.positions[:count],
        velocities=at.num_positions + at.velocities[:count],
        axes=axes,
        centre=X_HS.translation() - axes @ np.array([x, y, 0.0]),
    )


def check_contact(contact: str, ball: Ball, key: str, friction_reading: str = "velocity") -> None:
    """Raises InputError unless a ball can meet strings by this law on its plant."""
    if contact not in CONTACTS:
        raise InputError(key, contact, ", ".join(CONTACTS))
    if contact != ball.contact:
        raise InputError(
            key,
            contact,
            f"{ball.contact}, as the ball was made (add_ball(..., contact={contact!r}))",
        )
    if ball.plant.time_step() > 0.0:
        allowed = "a continuous one (time_step 0)"
        if contact == "surface":
            raise InputError(key, "surface, on a discrete plant", allowed)
        if friction_reading == "element":
            raise InputError(key, "friction reading element, on a discrete plant", allowed)
