"""Single numbers of a result, of arrays made by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray

from drake_racket import InputError, Scenario, simulate
from drake_racket.laws.contact import CONTACT
from drake_racket.laws.phases import PHASE
from drake_racket.laws.surface import GRIPS
from drake_racket.results.history import _surface_columns
from drake_racket.results.impact import _peak
from drake_racket.results.loads import racket_load
from drake_racket.results.log_checks import _check_values
from drake_racket.results.outputs import handle_ringing
from drake_racket.results.spin import _negative_share, angular_impulse
from drake_racket.results.summary import summary_rows
from drake_racket.results.warnings import _along_the_strings


@pytest.fixture(scope="module")
def result():
    return simulate(Scenario(after=0.001, audit=False), history=False)


def test_the_peak_is_the_parabolas_vertex_wherever_the_samples_are():
    time = 0.5 + np.array([0.0, 1.0, 1.8, 2.0])
    assert _peak(time, 3.0 - 0.7 * (time - 1.7) ** 2) == pytest.approx(3.0, abs=1e-12)
    assert _peak(time, np.array([1.0, 2.0, 5.0, 0.0])) == 5.0  # beside a jump
    assert _peak(time, np.array([1.0, 2.0, 5.0, 6.0])) == 6.0


def test_the_share_of_a_step_below_zero():
    found = _negative_share(np.array([1.0, 2.0, -2.0, -1.0, -1.0, 3.0, 0.0, 0.0]))
    np.testing.assert_allclose(found, [0.0, 0.5, 1.0, 1.0, 0.25, 0.0, 0.0])


def test_ringing_of_two_samples_and_of_one():
    log = xarray.Dataset(
        {
            "in_contact": ("time", [1, 0, 0]),
            "handle_acceleration": (("time", "axis"), [[0.0, 0, 9], [0, 0, 3.0], [0, 0, 5.0]]),
        },
        coords={"time": [0.0, 1.0, 2.0], "axis": list("xyz")},
    )
    assert handle_ringing(log) == pytest.approx(np.sqrt(0.5 * (9.0 + 25.0)))
    assert np.isnan(handle_ringing(log.isel(time=slice(0, 2))))


def test_no_load_without_a_hand():
    log = xarray.Dataset(coords={"landmark": ["butt", "tip"]})
    with pytest.raises(InputError, match="no load on a hand"):
        racket_load(log, "hand")


@pytest.mark.parametrize("length", [0.985, 1.015])
def test_a_quaternion_of_another_length_is_refused(length):
    table = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, length, 0.0, 0.0]])
    with pytest.raises(InputError, match="allowed: length 1"):
        _check_values(xarray.Dataset({"handle_quaternion": (("time", "q"), table)}), "log")
    _check_values(xarray.Dataset({"handle_quaternion": (("time", "q"), table[:1])}), "log")


def test_a_summary_has_no_minus_before_zero_and_no_momentum_that_is_unknown(result):
    small = replace(result, rebound_velocity=np.array([-0.001, 0.002, -5.0]), energy_error=1e-6)
    rows = dict(summary_rows(replace(small, momentum_error=None)))
    assert rows["Rebound speed"] == "5.00 m/s  (x +0.00, y +0.00, normal -5.00)"
    assert rows["Balance closes to"] == "energy 1.0e-06"
    rows = dict(summary_rows(replace(small, momentum_error=2e-9)))
    assert rows["Balance closes to"] == "energy 1.0e-06, momentum 2.0e-09"


def trajectory(places, **more):
    """The ball at `places`, in contact from the second sample on; a racket that turns away."""
    record = np.zeros((len(places), 60))
    record[1:, PHASE] = CONTACT
    record[2:, GRIPS] = 1.0
    poses = np.zeros((len(places), 2, 3, 4))
    poses[:, :, :, :3] = np.eye(3)
    poses[1:, 1, :, 3] = 0.7  # the handle, later
    velocities = np.zeros((len(places), 2, 6))
    velocities[:, 0, :3] = [1.0, 2.0, 3.0]
    bodies = SimpleNamespace(moments=np.tile(0.2 * np.eye(3), (2, 1, 1)))
    mechanism = SimpleNamespace(ball=0, handle=1, ball_position=0, ball_velocity=6, bodies=bodies)
    state = np.zeros((len(places), 9))
    state[:, :3] = places
    motion = SimpleNamespace(poses=poses, velocities=velocities, samples=np.arange(len(places)))
    made = {"record": record, "state": state, "mechanism": mechanism, "motion": motion}
    return SimpleNamespace(**(made | more))


@pytest.mark.parametrize(("along", "warned"), [(0.033, False), (0.036, True)])
def test_a_ball_that_leaves_its_string_masses_is_told_of(along, warned):
    """Half a spacing is 34.25 mm; what it moves across the strings does not count."""
    places = np.array([[0.0, 0, 0], [0.3, 0, 0], [0.3, 0, -0.1], [0.3, along, -0.05]])
    bed = SimpleNamespace(spacing=SimpleNamespace(value=0.0685))
    case = SimpleNamespace(
        scenario=SimpleNamespace(contact="surface"), racket=SimpleNamespace(string_bed=bed)
    )
    found = _along_the_strings(case, trajectory(places), SimpleNamespace(touches=1))
    assert bool(found) == warned
    if warned:
        assert "moved 36 mm along the strings" in found[0]


def test_columns_of_a_ball_that_spins():
    element = np.array([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]])
    columns = _surface_columns(trajectory(np.zeros((3, 3)), element=element))
    np.testing.assert_array_equal(columns["shear_x"], [0.0, 0.3, 0.5])
    np.testing.assert_array_equal(columns["shear_y"], [0.0, 0.4, 0.6])
    np.testing.assert_array_equal(columns["gripping"], [0.0, 0.0, 1.0])
    np.testing.assert_array_equal(columns["ball_spin"], [[1.0, 2.0, 3.0]] * 3)
    assert _surface_columns(trajectory(np.zeros((3, 3)), element=np.zeros((3, 0)))) == {}


def test_the_angular_impulse_is_about_the_rackets_first_place():
    places = np.array([[0.5, 0.0, 0.1], [0.5, 0.0, 0.1]])
    ran = trajectory(places)
    ran.state[:, 6:9] = [[0.0, 0.0, -20.0], [0.0, 0.0, 10.0]]
    ran.state[1, 3:6] = [0.0, 5.0, 0.0]  # and it leaves with a spin
    case = SimpleNamespace(ball=SimpleNamespace(mass=SimpleNamespace(value=0.06)))
    found = angular_impulse(case, ran, 0, 1, np.eye(3))
    np.testing.assert_allclose(found, [0.0, 0.06 * 0.5 * 30.0 - 0.2 * 5.0, 0.0], atol=1e-15)


def test_a_peak_at_a_kink_is_the_highest_sample():
    """As friction that turns round makes it; a parabola through it would rise to 520."""
    time = np.array([2156.1, 2204.2, 2226.0, 2241.8, 2250.0, 2257.8, 2265.0]) * 1e-6
    curve = np.array([427.4, 458.3, 482.5, 496.3, 409.5, 166.1, 156.7])
    assert _peak(time, curve) == 496.3
    # near an end it cannot be told from a smooth one
    assert _peak(time[2:], curve[2:]) > 515.0
