"""The shipped rackets as fine beams of the oracle, and in segments."""

from __future__ import annotations

import functools

import numpy as np

from drake_racket import load_ball, load_racket
from drake_racket.parameters.overrides import apply_overrides
from drake_racket.plant.ball import ball_law
from drake_racket.plant.string_bed import string_bed_model
from drake_racket.plant.systems.string_bed import spring_constants
from tests.oracles import fine_beam
from tests.oracles.modes import bending_plane

GRIP = 0.1


def segmented(racket: str, count: int, density: float):
    return apply_overrides(
        load_racket(racket), {"racket.frame.segments": count, "racket.frame.density": density}
    )


def fundamental(racket) -> float:
    """f1 (Hz) of the two published parts, out of plane, from the oracle's own matrices."""
    handle, head = racket.handle, racket.head
    frame = bending_plane(
        handle.mass.value,
        handle.length.value,
        handle.com.value,
        handle.moi_transverse.value,
        head.mass.value,
        head.com.value,
        head.moi_transverse.value,
        *racket.throat_joint.out_of_plane(),
    )
    return float(frame.frequencies()[-1])


@functools.cache
def fine(name: str, density: int, elements: int = 60):
    """A FineBeam of a shipped racket of family A (0) or B (1), and its EI."""
    racket = load_racket(name)
    throat = racket.handle.length.value
    length = throat + racket.head.length.value
    fixed = [0.0, GRIP / 2, GRIP, throat, length]
    x = np.unique(np.concatenate([np.linspace(0.0, length, elements + 1), fixed]))
    x = x[np.concatenate([[True], np.diff(x) > 1e-4])]
    x[-1] = length
    beam = fine_beam.FineBeam(x)
    for part, start in ((racket.handle, 0.0), (racket.head, throat)):
        mass, own = part.mass.value, (part.length.value, part.com.value)
        along, across, normal = part.moments()
        share = 0.5 * (along + across - normal) / mass
        if density == 0:
            second = 0.5 * (across + normal - along)
            beam.add_density(start, own[0], fine_beam.smooth(mass, *own, second), share)
        elif start == 0.0:
            beam.add_density(start, own[0], fine_beam.exponential(mass, *own), share)
        else:
            bed = racket.string_bed
            ellipse = bed.gsc.value, bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
            places, masses = fine_beam.hoop(mass, *own, *ellipse, points=4000)
            beam.add_points(start + places, masses, share * masses)
    return beam, beam.stiffness_for(fundamental(racket))


def strung(name: str) -> fine_beam.Strung:
    racket = load_racket(name)
    model, topology = string_bed_model(racket), racket.bed_topology()
    places = np.array([racket.point(i)[:2] for i in topology.points])
    at = places[topology.first] + model.lengths[:, None] * topology.directions
    return fine_beam.Strung(
        mass=racket.string_bed.mass.value,
        places=places,
        ends=np.stack([topology.first, topology.second], axis=1),
        rim=at[:, 0],
        stiffness=spring_constants(model)[0],
        lengths=model.lengths,
        tension=racket.string_bed.initial_tension.value,
    )


def beam_impact(
    name: str, density: int, support: str, hand=None, speed: float = 25.0, clamp: float = GRIP / 2
):
    """An impact at the centre; a clamp holds the beam from the butt to `clamp` (m)."""
    racket, ball = load_racket(name), load_ball()
    beam, stiffness = fine(name, density)
    kf, cf = racket.throat_joint.out_of_plane()
    low, high, k, k_growth, c, c_growth, *_ = ball_law(ball)
    share = (speed - low) / (high - low)
    law = ball.mass.value, k * (1.0 + k_growth * share), c * (1.0 + c_growth * share)
    held = np.flatnonzero(np.repeat(beam.x <= clamp + 1e-9, 2)) if support == "clamped" else ()
    grip = None
    if hand is not None:
        force = hand.force_stiffness.value[2], hand.force_damping.value[2]
        torque = hand.torque_stiffness.value[1], hand.torque_damping.value[1]
        grip = racket.landmarks.grip.value, force, torque
    return fine_beam.impact(
        beam, stiffness, cf / kf, strung(name), law, 4, speed, held=held, hand=grip
    )
