"""The sample studies in short: their numbers against closed forms, the oracle and single runs."""

from __future__ import annotations

import math
import runpy

import numpy as np
import pytest
import xarray

from drake_racket import Scenario, load_racket, simulate
from drake_racket.parameters.scenario import IntegratorSettings
from drake_racket.results.outputs import VIBRATION, handle_ringing
from tests.conftest import clamped_problem
from tests.oracles.clamped_impact import simulate as oracle
from tests.oracles.two_body import free_free_frequency


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    """Runs a study with --quick; returns its directory and namespace."""
    ran = {}

    def run(name):
        if name not in ran:
            out = tmp_path_factory.mktemp(name)
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr("sys.argv", [name, "--quick", "--out", str(out)])
                ran[name] = out, runpy.run_module(f"studies.{name}", run_name="__main__")
        return ran[name]

    return run


def test_tension_agrees_with_the_oracle(quick):
    out, _ = quick("tension_and_power")
    dataset = xarray.open_dataset(out / "sweep" / "results.nc")
    assert (out / "tension.png").stat().st_size > 10_000
    assert dataset["tension"].to_numpy().tolist() == [254.0, 311.0]
    bed = dataset.sel(racket="tour", support="clamped_head", point=5)
    for n, tension in enumerate(("low", "high")):  # the printed beds are at 254 and 311 N
        wanted = oracle(clamped_problem("tour", tension, 5, 25.0))
        assert float(bed["restitution"][n]) == pytest.approx(wanted.rebound_speed / 25.0, abs=2e-4)


def test_frame_study(quick):
    out, _ = quick("frame_stiffness_and_handle_vibration")
    dataset = xarray.open_dataset(out / "frame.nc")
    assert (out / "frame.png").stat().st_size > 10_000
    racket = load_racket("tour")
    stiffness = racket.throat_joint.out_of_plane()[0]
    wanted = [free_frequency(racket, factor * stiffness) for factor in (1.0, 2.0)]
    np.testing.assert_allclose(dataset["fundamental"], wanted, rtol=1e-3)
    # the ringing that is read from the file is the rig's of the same impact
    result = simulate(
        Scenario(
            point="2",
            approach_time=1e-4,
            after=0.008,
            audit=False,
            engine="compiled",
            integrator=IntegratorSettings(accuracy=2e-2),
        )
    )
    rig = {output.name: output for output in VIBRATION}["handle_ringing"].read(result)
    case = dataset.sel(support="free", point=2, stiffness=1.0, damping=1.0)
    assert float(case["handle_ringing"]) == pytest.approx(rig, rel=1e-9)
    assert float(case["rebound_speed"]) == pytest.approx(
        float(np.linalg.norm(result.rebound_velocity)), rel=1e-9
    )


def free_frequency(racket, stiffness):
    """Two rigid bodies hinged at the throat: out of plane, about y."""
    handle, head = racket.handle, racket.head
    return free_free_frequency(
        handle.mass.value,
        handle.length.value,
        handle.com.value,
        handle.moi_transverse.value,
        head.mass.value,
        head.com.value,
        head.moi_transverse.value,
        stiffness,
    )


@pytest.mark.slow
def test_sweet_spots_of_a_few_aims(quick):
    out, study = quick("sweet_spots")
    dataset = xarray.open_dataset(out / "tour" / "results.nc")
    assert (out / "sweet_spots.png").stat().st_size > 10_000
    places = np.stack([dataset["offset_x"], dataset["offset_y"]], axis=1)
    assert places.tolist() == study["aims"](load_racket("tour"), 0.1)
    centre = dataset.isel(aim=1)
    assert int(centre["touched_point"]) == 5
    # more at the throat than at the tip
    assert float(dataset["restitution"][0]) > float(dataset["restitution"][-1])
    # one half is computed: the other is alike
    left, right = (
        simulate(
            Scenario(support="grip", point="auto", offset_y=y, after=0.008, audit=False),
            history=False,
        ).apparent_restitution
        for y in (0.05, -0.05)
    )
    assert left == pytest.approx(right, rel=1e-6)


def test_aims_lie_within_the_rim_on_one_half():
    study = runpy.run_module("studies.sweet_spots.__main__")
    for name in ("tour", "recreational"):
        racket = load_racket(name)
        bed = racket.string_bed
        aims = np.array(study["aims"](racket, 0.02))
        assert len({tuple(aim) for aim in aims}) == len(aims)
        assert aims[:, 1].min() == 0.0
        reach = np.hypot(
            aims[:, 0] / bed.rim_semi_axis_x.value, aims[:, 1] / bed.rim_semi_axis_y.value
        )
        assert 0.75 < reach.max() <= 0.85 + 1e-9
        # mirrored, the squares cover the ellipse but for its border
        area = 4e-4 * (2 * len(aims) - np.count_nonzero(aims[:, 1] == 0.0))
        ellipse = 0.85**2 * math.pi * bed.rim_semi_axis_x.value * bed.rim_semi_axis_y.value
        assert area == pytest.approx(ellipse, rel=0.05)


def test_centre_of_percussion_does_not_push_the_hand():
    """A force there turns the free rigid racket about the hand's place: its velocity is 0."""
    study = runpy.run_module("studies.sweet_spots.__main__")
    racket = load_racket("tour")
    at = study["closed_forms"](racket)["peak_hand_force"]
    handle, head, bed = racket.handle, racket.head, racket.string_bed
    parts = [
        (handle.mass.value, handle.com.value, handle.moi_transverse.value),
        (head.mass.value, handle.length.value + head.com.value, head.moi_transverse.value),
        *((bed.mass.value / 9.0, racket.point(i)[0], 0.0) for i in range(1, 10)),
    ]
    mass = sum(m for m, _, _ in parts)
    com = sum(m * x for m, x, _ in parts) / mass
    moment = sum(own + m * (x - com) ** 2 for m, x, own in parts)
    hand = racket.landmarks.grip.value
    velocity = 1.0 / mass - (com - hand) * (at - com) / moment  # by a unit impulse
    assert abs(velocity) * mass < 1e-9


def history(values, time, contact):
    acceleration = np.zeros((len(time), 3))
    acceleration[:, 2] = values
    return xarray.Dataset(
        {
            "handle_acceleration": (("time", "axis"), acceleration),
            "in_contact": ("time", contact),
        },
        coords={"time": time, "axis": ["x", "y", "z"]},
    )


def test_ringing_of_a_cosine_is_its_amplitude_over_root_two():
    rng = np.random.default_rng(1)
    after = 0.005 + 0.02 * np.sort(np.concatenate([[0.0, 1.0], rng.random(4000)]))  # two periods
    time = np.concatenate([[0.0, 0.002, 0.004], after])
    values = np.concatenate([[9e3] * 3, 300.0 * np.cos(2.0 * np.pi * 100.0 * (after - 0.005))])
    made = history(values, time, (time < 0.0045).astype(float))
    assert handle_ringing(made) == pytest.approx(300.0 / math.sqrt(2.0), rel=1e-4)
    assert math.isnan(handle_ringing(history(values, time, np.ones(len(time)))))


@pytest.mark.parametrize("name", ["tension_and_power", "sweet_spots"])
def test_a_study_refuses_a_file_as_directory_in_one_line(name, tmp_path, refused_by_study):
    (tmp_path / "file").write_text("")
    assert "--out" in refused_by_study(name, "--quick", "--out", tmp_path / "file" / "x")


@pytest.mark.slow
def test_ten_grams(quick):
    out, names = quick("where_to_put_ten_grams")
    before, after = (
        names["row"].__globals__["csv"].DictReader((out / "ten_grams.csv").read_text().splitlines())
    )
    assert (out / "ten_grams.png").stat().st_size > 10_000
    assert (before["place"], after["place"]) == ("nowhere", "12 o'clock")
    swing = float(before["swingweight [kg*m^2]"]) + 0.010 * (0.675 - 0.1016) ** 2
    assert float(after["swingweight [kg*m^2]"]) == pytest.approx(swing, rel=1e-12)
    single = simulate(Scenario(speed=25.0, after=0.008), history=False)
    assert float(before["restitution centre [1]"]) == pytest.approx(
        single.apparent_restitution, abs=1e-4
    )
    # at the same effort the gain at the tip is what is left after a slower swing
    rate, effort = (float(after[f"same {way}, centre [m/s]"]) for way in ("rate", "effort"))
    restitution = (rate - 27.0 * 0.711) / (27.0 * 0.711 + 10.0)
    slower = 27.0 * (swing / float(before["swingweight [kg*m^2]"])) ** -0.27 * 0.711
    assert effort == pytest.approx(restitution * (slower + 10.0) + slower, rel=1e-6)


@pytest.mark.slow
def test_my_swing(quick):
    out, names = quick("which_racket_for_my_swing")
    rows = list(
        names["main"].__globals__["csv"].DictReader((out / "my_swing.csv").read_text().splitlines())
    )
    assert (out / "my_swing.png").stat().st_size > 10_000
    assert [row["player"] for row in rows] == ["same rate", "same effort"] * 2
    assert float(rows[0]["swingweight [kg*m^2]"]) == pytest.approx(0.0344)
    assert float(rows[1]["own rate [rad/s]"]) == pytest.approx(15.0 * (344 / 320) ** -0.27)
    assert float(rows[1]["centre [m/s]"]) < float(rows[0]["centre [m/s]"])


def test_strings_or_frame(quick):
    out, _ = quick("strings_or_frame_and_the_arm")
    dataset = xarray.open_dataset(out / "sweep" / "results.nc")
    assert (out / "changes.png").stat().st_size > 10_000
    assert dataset["change"].to_numpy().tolist() == [
        "as it is",
        "strings: tension -20 %",
        "frame: stiffness +20 %",
    ]
    racket = load_racket("tour")
    changed = {
        "racket.string_bed.initial_tension": 0.8 * racket.string_bed.initial_tension.value,
    }
    case = Scenario(
        support="grip",
        approach_time=1e-4,
        after=0.03,
        audit=False,
        overrides=changed,
    )
    result = simulate(case)  # in Drake; the sweep may have run compiled
    assert float(dataset["restitution"].sel(point=5)[1]) == pytest.approx(
        result.apparent_restitution, rel=1e-4
    )
    assert float(dataset["handle_ringing"].sel(point=5)[1]) == pytest.approx(
        handle_ringing(result.history), rel=2e-3
    )


def test_spin_and_angle_has_single_impacts_and_a_figure(quick):
    out, _ = quick("spin_and_angle")
    assert (out / "spin_and_angle.png").stat().st_size > 10_000
    maps = xarray.open_dataset(out / "maps" / "results.nc")
    one = maps.sel(support="free", friction=0.6, spin_rpm=-3000.0, incidence_deg=35.0)
    scenario = Scenario(
        contact="surface",
        incidence_deg=35.0,
        spin_rpm=-3000.0,
        approach_time=1e-4,
        after=0.008,
        audit=False,
        overrides={"racket.friction.coefficients.mu1": 0.6},
    )
    result = simulate(scenario, engine="compiled", history=False)
    assert float(one["rebound_speed"]) == pytest.approx(
        np.linalg.norm(result.rebound_velocity), rel=1e-12
    )
    assert float(one["rebound_angle_y"]) == result.rebound_angles[1]
    spin = float(one["spin_after_rpm"]) * math.pi / 30.0
    assert spin == pytest.approx(-result.spin_after[0], rel=1e-12)
