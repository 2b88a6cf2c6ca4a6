"""Touch and release on a record: as floats, on AutoDiffXd, and compiled; and the phases' order."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.autodiffutils import AutoDiffXd

from drake_racket.laws.compilation import compiled
from drake_racket.laws.contact import CONTACT, FREE, PASSED
from drake_racket.laws.phases import (
    AT_BALL,
    BY_DISPLACEMENT,
    CB,
    DB,
    DISCRETE_SIZE,
    GIVEN_UP,
    HB,
    KB,
    LEAD,
    MU,
    OFFSET_X,
    OFFSET_Y,
    PHASE,
    POINT,
    RATE,
    RELEASE,
    SCALE,
    SPEED,
    TOUCH,
    TOUCHES,
    WEIGHT,
    contact_record,
    inside_rim,
    late_touch,
    nearest_point,
    next_phase,
    release,
    touch,
    value_of,
)

BALL = np.array([18.0, 33.0, 45e3, 0.52, 14.0, 0.97, 3e5, 200.0])
FRICTION = np.array([0.3, 0.4, 0.5, 0.6])
SCALES = np.array([0.02, 1e-4])
GRID = np.array([(0.03, 0.02), (0.03, -0.02), (-0.03, 0.02), (-0.03, -0.02)])
RIM = (0.16, 0.12)


def a_bounce(record, p, v, late, end, again):
    """A late first touch at point 3, a release, and a second touch at point 2."""
    touch(record, 3, p, v, 0.25, BALL, FRICTION, SCALES, np.array([0.0, 1.0, 1.0]))
    late_touch(record, late, v, 1e-4)
    release(record, end, 0.254)
    touch(record, 2, again, v, 0.26, BALL, FRICTION, SCALES, np.array([0.0, 0.0, 0.0]))


PLACES = (
    np.array([0.001, 0.002, 0.0]),
    np.array([3.0, 4.0, -25.0]),
    np.array([0.0, 0.0, -0.001]),
    np.array([0.01, 0.0, -0.002]),
    np.array([0.02, 0.03, 0.0]),
)


def test_a_bounce_leaves_what_it_should():
    record = np.zeros(DISCRETE_SIZE)
    a_bounce(record, *PLACES)
    kb = 45e3 * (1.0 + 0.52 * 7.0 / 15.0)  # at 25 m/s, by hand
    assert record[KB] == pytest.approx(kb, rel=1e-14)
    assert record[CB] == pytest.approx(14.0 * (1.0 + 0.97 * 7.0 / 15.0), rel=1e-14)
    # the second touch latches its own point and friction, not approach speed, time, kb, cb
    assert (record[PHASE], record[POINT], record[TOUCHES]) == (CONTACT, 2.0, 2.0)
    assert (record[SPEED], record[TOUCH], record[RELEASE]) == (25.0, 0.25, 0.254)
    assert (record[MU], record[SCALE], record[BY_DISPLACEMENT], record[AT_BALL]) == (
        0.4,
        0.02,
        0.0,
        0.0,
    )
    assert (record[OFFSET_X], record[OFFSET_Y]) == (0.02, 0.03)
    given_up = 0.5 * kb * 0.002**2 + 3e5 * 0.002**3 / 3.0
    assert record[GIVEN_UP] == pytest.approx(given_up, rel=1e-14)
    assert (record[HB], record[DB]) == (3e5, 200.0)
    # the first touch was 0.001 / 25 s before its step of 1e-4 s: half a step more, and 0.4 steps
    assert record[WEIGHT] == pytest.approx(0.9)
    assert record[RATE].tolist() == [3.0, 4.0, -25.0]
    assert record[LEAD].tolist() == [0.0, 0.0, 0.0]
    told = contact_record(record)
    assert (told.phase, told.point, told.touches, told.kb) == (CONTACT, 2, 2, record[KB])


def test_the_reading_by_displacement_has_its_own_scale():
    record = np.zeros(DISCRETE_SIZE)
    p, v, *_ = PLACES
    touch(record, 1, p, v, 0.0, BALL, FRICTION, SCALES, np.array([1.0, 1.0, 1.0]))
    assert (record[SCALE], record[BY_DISPLACEMENT], record[AT_BALL]) == (1e-4, 1.0, 1.0)
    assert record[MU] == 0.3


def test_a_run_that_starts_in_contact_is_not_late():
    record = np.zeros(DISCRETE_SIZE)
    late_touch(record, np.array([0.0, 0.0, -0.01]), np.array([0.0, 0.0, -25.0]), 1e-4)
    assert record[WEIGHT] == 0.5


def test_compiled_they_do_the_same():
    plain, fast = np.zeros(DISCRETE_SIZE), np.zeros(DISCRETE_SIZE)
    a_bounce(plain, *PLACES)
    compiled(a_bounce)(fast, *PLACES)
    np.testing.assert_array_equal(plain, fast)


def test_on_autodiff_they_carry_derivatives():
    plain = np.zeros(DISCRETE_SIZE)
    a_bounce(plain, *PLACES)
    record = np.array([AutoDiffXd(0.0, np.zeros(1))] * DISCRETE_SIZE)
    p, v, late, end, again = (np.array([AutoDiffXd(x, [0.0]) for x in a]) for a in PLACES)
    v[2] = AutoDiffXd(-25.0, [1.0])
    a_bounce(record, p, v, late, end, again)
    assert [value_of(x) for x in record] == pytest.approx(plain.tolist(), rel=1e-14)
    assert record[SPEED].derivatives() == pytest.approx([-1.0])
    assert record[KB].derivatives() == pytest.approx([-45e3 * 0.52 / 15.0])
    assert record[GIVEN_UP].derivatives() == pytest.approx([-0.5 * 45e3 * 0.52 / 15.0 * 0.002**2])


@pytest.mark.parametrize(
    ("phase", "gap", "rate", "raw", "inside", "expected"),
    [
        (FREE, 0.1, -1.0, 0.0, True, FREE),
        (FREE, 0.0, -1.0, 0.0, True, CONTACT),
        (FREE, -1e-9, -1.0, 0.0, True, CONTACT),
        (FREE, -1e-9, -1.0, 0.0, False, PASSED),
        (FREE, 0.0, -1.0, 0.0, False, FREE),  # not through yet
        (FREE, 0.0, 0.0, 0.0, True, FREE),  # at rest on the strings: no touch
        (FREE, -1e-9, 1.0, 0.0, True, PASSED),
        (CONTACT, -0.01, 1.0, 1e-9, True, CONTACT),
        (CONTACT, -0.01, 1.0, 0.0, True, PASSED),
        (CONTACT, 0.0, 1.0, -1.0, True, FREE),
        (PASSED, -1e-9, 1.0, 5.0, True, PASSED),
        (PASSED, 0.0, 1.0, 5.0, True, FREE),
        (PASSED, -0.1, -1.0, 5.0, True, PASSED),  # no touch from below
    ],
)
def test_phases_follow_one_another(phase, gap, rate, raw, inside, expected):
    assert next_phase(phase, gap, rate, raw, inside) == expected
    seeded = (AutoDiffXd(x, [1.0]) for x in (gap, rate, raw))
    assert next_phase(phase, *seeded, inside) == expected


@settings(max_examples=100, deadline=None)
@given(x=st.floats(-0.1, 0.1), y=st.floats(-0.1, 0.1))
def test_no_point_is_nearer_than_the_nearest(x, y):
    number = nearest_point(GRID, x, y)
    distance = np.hypot(GRID[:, 0] - x, GRID[:, 1] - y)
    assert distance[number - 1] == pytest.approx(distance.min(), abs=1e-12)


def test_of_points_that_are_equally_near_the_first_counts():
    assert nearest_point(GRID, 0.0, 0.0) == 1
    assert nearest_point(GRID, -1.0, 0.0) == 3


@settings(max_examples=100, deadline=None)
@given(turn=st.floats(0.0, 6.283), point=st.integers(1, 4))
def test_the_rim_is_an_ellipse_about_the_centre(turn, point):
    edge = np.array([RIM[0] * math.cos(turn), RIM[1] * math.sin(turn)])
    assert inside_rim(GRID, RIM, point, 0.999 * edge - GRID[point - 1])
    assert not inside_rim(GRID, RIM, point, 1.001 * edge - GRID[point - 1])
