"""Beds of more masses: the given bed comes back, calibration, and places between points."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest

from drake_racket import InputError, Scenario, finer_bed, load_racket, make_impact_diagram, resolve
from drake_racket.engines.compiled.engine import CompiledImpact
from drake_racket.parameters.finer_bed import _spring
from drake_racket.plant.string_bed import string_bed_model
from drake_racket.plant.systems.string_bed import spring_constants
from drake_racket.results.impact import make_result
from drake_racket.rigs import calibrated_bed, convergence, finer_beds, place_deflection

TOUR = load_racket("tour")
PLACES = TOUR.string_bed.spacing.value * TOUR.bed_topology().places


def constants(racket):
    return spring_constants(string_bed_model(racket))


@pytest.mark.parametrize("name", [("tour", "low"), ("recreational", "high")])
def test_three_lines_are_the_given_bed(name):
    racket = load_racket(*name)
    made = finer_bed(racket, 3)
    np.testing.assert_allclose(constants(made), constants(racket), rtol=1e-14)
    assert made.friction_coefficients() == racket.friction_coefficients()
    assert made.string_mass() == racket.string_mass()


def test_more_lines_share_mass_tension_and_springs():
    made = finer_bed(TOUR, 5)
    assert made.string_bed.mass == TOUR.string_bed.mass
    assert 5 * made.string_bed.initial_tension.value == pytest.approx(3 * 648.2)
    assert made.string_bed.spacing.value == pytest.approx(0.03425)
    names, k = made.bed_topology().names, np.array(made.string_bed.stiffness.value)
    own = dict(zip(names, k, strict=True))
    # the centre main's springs have the given one's EA, three fifths of it
    assert own["8-13"] * 0.03425 == pytest.approx(0.6 * 7.91e5 * 0.0685)
    # halfway between the side main (k2) and the centre main (k4)
    assert own["7-12"] == pytest.approx(0.5 * (own["6-11"] + own["8-13"]))
    assert own["6-11"] * 0.03425 == pytest.approx(0.6 * 2.00e5 * 0.0685)
    # left and right alike, tip and throat not
    assert own["tip-1"] == own["tip-5"]
    assert own["tip-3"] != own["throat-23"]


def test_every_place_on_a_line_is_on_the_spring_that_passes_there():
    """Whichever spring of the given bed has its middle nearest: 3 lines, along x and along y."""
    bed = TOUR.bed_topology()
    ends = bed.places[bed.first]
    other = np.where((bed.second < 0)[:, None], ends + bed.directions, bed.places[bed.second])
    middles = 0.5 * (ends + other)
    for along, line, place in itertools.product((0, 1), range(3), (-1.5, -0.4, 0.4, 1.5)):
        at = np.empty(2)
        at[along], at[1 - along] = place, 1.0 - line
        nearest = bed.names[int(np.argmin(np.sum((middles - at) ** 2, axis=1)))]
        assert _spring(line, along, place, abs(place) > 1.0) == nearest


def test_a_calibrated_bed_gives_way_as_the_given_one():
    bed = calibrated_bed(TOUR, 5)
    assert 1.1 < bed.tension < 1.5
    for force in (1.0, 800.0):
        means = [
            np.mean([force / place_deflection(r, x, y, force) for x, y in PLACES])
            for r in (bed.racket, TOUR)
        ]
        assert means[0] == pytest.approx(means[1], rel=1e-5)


def test_what_the_places_between_the_points_lose_grows_less():
    found = convergence(TOUR, lines=(3, 5), step=0.03425)
    middle, between, point = (found["restitution"].sel(axis="x")[:, i] for i in range(3))
    assert float(between[0]) < 0.82  # 0.83-0.85 is measured
    dip = 0.5 * (middle + point) - between
    assert abs(float(dip[1])) < 0.4 * float(dip[0])
    assert found["tension"].to_numpy()[0] == 1.0
    assert found["place"].to_numpy() == pytest.approx([0.0, 0.03425, 0.0685])
    pressed = found["deflection"].sel(lines=3)
    for axis, direction in (("x", (1.0, 0.0)), ("y", (0.0, 1.0))):
        expected = [
            place_deflection(TOUR, *np.multiply(direction, a), 800.0)
            for a in (0.0, 0.03425, 0.0685)
        ]
        assert pressed.sel(axis=axis).to_numpy() == pytest.approx(expected)


def test_balls_are_shot_along_the_normal_at_both_axes(monkeypatch):
    shot = []

    def spy(racket, ball, places, velocities):
        shot.append((places, velocities))
        return made(racket, ball, places, velocities)

    made = finer_beds.spinning_impacts
    monkeypatch.setattr(finer_beds, "spinning_impacts", spy)
    found = convergence(TOUR, lines=(3,), step=0.06, reach=0.06, speed=21.0)
    for (places, velocities), along in zip(shot, np.eye(2), strict=True):
        np.testing.assert_allclose(places, np.outer([0.0, 0.06], along))
        assert velocities.tolist() == [[0.0, 0.0, -21.0]] * 2
    assert found["place"].to_numpy() == pytest.approx([0.0, 0.06])
    assert found.attrs["title"].endswith("head clamped, 21 m/s, contact surface")
    centre = found["restitution"][0, :, 0].to_numpy()
    assert centre[0] == pytest.approx(centre[1], rel=1e-9)
    times = found["contact_time"].to_numpy()
    assert np.all((times > 3e-3) & (times < 6e-3))


def test_a_finer_bed_runs_in_the_engines():
    """In the compiled engine on a free racket: energy closes, restitution stays near."""
    base = Scenario(contact="surface", after=0.006, approach_time=0.0, point="auto")
    case = resolve(base)
    results = []
    for racket in (TOUR, calibrated_bed(TOUR, 5).racket):
        own = dataclasses.replace(case, racket=racket)
        results.append(
            make_result(own, CompiledImpact(make_impact_diagram(own)).run(own), history=True)
        )
    assert results[1].energy_error < 1e-4
    assert results[1].point == 13  # the middle of twenty-five
    ours, theirs = (r.apparent_restitution for r in results)
    assert theirs == pytest.approx(ours, abs=0.02)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: finer_bed(TOUR, 4), "lines: got 4; allowed: an odd number from 3 to 15"),
        (lambda: finer_bed(TOUR, 5, tension=0.0), "tension: got 0"),
        (lambda: finer_bed(finer_bed(TOUR, 5), 7), "racket: got '5 x 5 masses'"),
        (lambda: calibrated_bed(TOUR, 2), "lines: got 2"),
    ],
)
def test_bad_beds_in_one_line(call, said):
    with pytest.raises(InputError, match=said):
        call()
