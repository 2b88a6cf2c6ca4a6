"""Densities, slices and chains of laws.flexure against other ways of computing them."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from drake_racket import load_racket
from drake_racket.laws import densities, flexure
from tests.oracles import fine_beam
from tests.oracles.two_body import free_free_frequency

MASS, LENGTH, COM, SECOND = 0.1335, 0.356, 0.11365, 0.001705


def sums(density, places):
    """Mass, centre and second moment from slices between places."""
    pieces = [density(a, b) for a, b in itertools.pairwise(places)]
    x, m = (np.concatenate(group) for group in zip(*pieces, strict=True))
    com = np.sum(m * x) / np.sum(m)
    return np.sum(m), com, np.sum(m * (x - com) ** 2)


@given(
    st.floats(0.05, 0.9),
    st.floats(0.1, 0.9),
    st.lists(st.floats(0.01, 0.99), min_size=1, max_size=11, unique=True),
)
@settings(max_examples=60, deadline=None)
def test_slices_of_a_smooth_density_have_all_of_it(com, spread, cuts):
    """Mass, centre and second moment to 1e-12, whatever the part and where it is cut."""
    second = spread * 0.2 * com * (1.0 - com) * 4.0
    second = min(second, 0.9 * com * (1.0 - com))
    if second < 0.02:
        return  # nearly a point: no density of two numbers fits it to rounding
    density = densities.smooth_density(MASS, LENGTH, com * LENGTH, second * MASS * LENGTH**2)
    places = [0.0, *sorted(LENGTH * c for c in cuts), LENGTH]
    mass, centre, moment = sums(density, places)
    assert mass == pytest.approx(MASS, rel=1e-12)
    assert centre == pytest.approx(com * LENGTH, rel=1e-11)
    assert moment == pytest.approx(second * MASS * LENGTH**2, rel=1e-10)


def test_the_smooth_density_is_the_maximum_entropy_one():
    """Against a root search on adaptive integrals."""
    other = fine_beam.smooth(MASS, LENGTH, COM, SECOND)
    density = densities.smooth_density(MASS, LENGTH, COM, SECOND)
    for a, b in ((0.0, 0.05), (0.1, 0.2), (0.3, LENGTH)):
        assert np.sum(density(a, b)[1]) == pytest.approx(quad(other, a, b)[0], rel=1e-9)


def test_the_hoop_is_the_ellipses_arc():
    ellipse = 0.155, 0.164, 0.123
    x, m = fine_beam.hoop(0.1605, 0.33, 0.15032, *ellipse)
    density = densities.hoop_density(0.1605, 0.33, 0.15032, ellipse)
    for a, b in ((0.0, 0.1), (0.1, 0.2), (0.25, 0.33)):
        expected = np.sum(m[(x > a) & (x < b)])
        assert np.sum(density(a, b)[1]) == pytest.approx(expected, rel=1e-4)
    mass, centre, _ = sums(density, [0.0, 0.11, 0.3, 0.33])
    assert mass == pytest.approx(0.1605, rel=1e-12)
    assert centre == pytest.approx(0.15032, rel=1e-12)


def test_an_exponential_handle():
    other = fine_beam.exponential(MASS, LENGTH, COM)
    density = densities.smooth_density(MASS, LENGTH, COM, None)
    for a, b in ((0.0, 0.05), (0.3, LENGTH)):
        assert np.sum(density(a, b)[1]) == pytest.approx(quad(other, a, b)[0], rel=1e-9)


def test_the_mixture_is_in_between():
    one = densities.smooth_density(MASS, LENGTH, COM, SECOND)
    two = densities.smooth_density(MASS, LENGTH, COM, None)
    both = densities.mixed(one, two, 0.3)
    for a, b in ((0.0, 0.1), (0.2, LENGTH)):
        expected = 0.7 * np.sum(one(a, b)[1]) + 0.3 * np.sum(two(a, b)[1])
        assert np.sum(both(a, b)[1]) == pytest.approx(expected, rel=1e-13)
    assert densities.mixed(one, two, 0.0) is one


def test_boundaries():
    assert flexure.boundaries(2, 0.686, 0.356, 0.1) == (0.0, 0.356, 0.686)
    found = flexure.boundaries(4, 0.7, 0.356, 0.1)
    assert found == pytest.approx((0.0, 0.1, 0.3, 0.5, 0.7))


def test_compliances_are_those_of_the_beam_between_the_middles():
    """Over steps of EI; all together they bend as the beam does, less its two ends."""
    places, steps, values = (0.0, 0.1, 0.4, 0.8), [0.3], [1.0, 2.5]
    found = flexure.compliances(places, steps, values)

    def inverse(x):
        return 1.0 / (values[0] if x < steps[0] else values[1])

    for c, a, b in zip(found, (0.05, 0.25), (0.25, 0.6), strict=True):
        assert c == pytest.approx(quad(inverse, a, b, points=steps)[0], rel=1e-9)


def parts_of(racket):
    handle, head = racket.handle, racket.head
    return handle, head


@pytest.mark.parametrize("name", ["tour", "recreational"])
@pytest.mark.parametrize("plane", ["in_plane", "out_of_plane"])
def test_two_slices_have_the_closed_forms_frequency(name, plane):
    handle, head = parts_of(load_racket(name))
    moment = "moi_frontal" if plane == "in_plane" else "moi_transverse"
    kf = load_racket(name).throat_joint.constants(plane)[0]
    first, second = load_racket(name).handle.length.value, load_racket(name).head.length.value
    pieces = []
    for part, start, end in ((handle, 0.0, first), (head, first, first + second)):
        along, across, normal = part.moments()
        xx, yy, zz = (
            0.5 * (across + normal - along),
            0.5 * (along + normal - across),
            0.5 * (along + across - normal),
        )
        mass, com = part.mass.value, start + part.com.value
        pieces.append(flexure.Slice(start, end, mass, com, 0.0, xx, yy, zz, 0.0))
    found = flexure.free_frequencies(pieces, plane, np.array([kf]))
    expected = free_free_frequency(
        handle.mass.value,
        first,
        handle.com.value,
        getattr(handle, moment).value,
        head.mass.value,
        head.com.value,
        getattr(head, moment).value,
        kf,
    )
    assert found == pytest.approx([expected], rel=1e-12)


def test_a_cut_without_mass_is_refused():
    part = flexure.PartMass(
        0.0,
        0.3,
        densities.hoop_density(0.1, 0.3, 0.15, (0.15, 0.1, 0.1)),
        0.15,
        0.0,
        0.0,
        1e-4,
        1e-5,
    )
    with pytest.raises(ValueError, match=r"no mass between 0 and 0\.04 m"):
        flexure.cut([part], [0.0, 0.04, 0.3])


def test_the_half_width_of_an_ellipse():
    width = flexure.ellipse_width(0.5, 0.2, 0.1)
    x = np.array([0.2, 0.3, 0.4, 0.5, 0.62, 0.8])
    np.testing.assert_allclose(width(x), [0.0, 0.0, 0.1 * np.sqrt(0.75), 0.1, 0.08, 0.0])
