"""The force plate against the damped oscillator, itself checked by matrix exponentials."""

from __future__ import annotations

import dataclasses
import runpy
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_racket.io.errors import InputError
from drake_racket.io.signals import Signal, read_signal
from drake_racket.parameters.ball import load_ball
from drake_racket.parameters.scenario import IntegratorSettings
from drake_racket.plots.rigs.force_plate import force_plate_figure
from drake_racket.rigs.force_plate.force import analyse_force, closed_form, sample_times
from drake_racket.rigs.force_plate.plate import make_force_plate, plate_dataset
from tests.conftest import ROOT, kb_cb, write_signal
from tests.oracles.damped_oscillator import Oscillator

STUDY = ROOT / "studies" / "force_plate.py"
TIGHT = IntegratorSettings(maximum_step=1e-6, error_control=False)


@pytest.fixture(scope="module")
def plate():
    return make_force_plate()


def with_law(kb: float, cb: float, mass: float = 0.059):
    ball = load_ball()
    values = {"mass": mass, "stiffness_low": kb, "damping_low": cb, "stiffness_growth": 0.0}
    values["damping_growth"] = 0.0
    return dataclasses.replace(
        ball, **{k: dataclasses.replace(getattr(ball, k), value=v) for k, v in values.items()}
    )


def check(found, oracle: Oscillator, relative: float) -> None:
    time, height = oracle.peak()
    assert found.contact_time == pytest.approx(oracle.contact_time(), rel=relative)
    assert found.restitution == pytest.approx(oracle.restitution(), rel=relative)
    assert found.peak_force == pytest.approx(height, rel=relative)
    # the top of the force is flat: its time is known to the root of the force's precision
    assert found.peak_time == pytest.approx(time, rel=3e-6, abs=1e-12)
    impulse = oracle.mass * oracle.speed * (1.0 + oracle.restitution())
    assert found.impulse == pytest.approx(impulse, rel=relative)


@pytest.mark.parametrize("ratio", [0.0, 0.1, 0.3, 0.499, 0.5, 0.8, 0.999999, 1.0, 1.000001, 1.7])
def test_closed_form_equals_the_matrix_exponential(ratio) -> None:
    kb, mass, speed = 45e3, 0.059, 25.0
    oracle = Oscillator(mass, kb, 2.0 * ratio * np.sqrt(kb * mass), speed)
    form = closed_form(mass=mass, stiffness=kb, damping=oracle.damping, speed=speed)
    check(form, oracle, 1e-9)
    for time in form.contact_time * np.array([0.0, 0.2, 0.6, 0.99]):
        assert form.force(time) == pytest.approx(oracle.force(time), rel=1e-9)
    assert form.force(1.001 * form.contact_time) == 0.0
    assert form.force(-1e-6) == 0.0


@pytest.mark.parametrize("speed", [18.0, 33.0])
def test_plate_equals_the_oscillator(plate, speed) -> None:
    kb, cb = kb_cb(load_ball(), speed)
    found = plate.run(speed, settings=TIGHT)
    assert (found.kb, found.cb) == pytest.approx((kb, cb), rel=1e-12)
    oracle = Oscillator(0.059, kb, cb, speed)
    check(found, oracle, 1e-8)
    form = closed_form(mass=0.059, stiffness=kb, damping=cb, speed=speed)
    assert np.abs(found.force - form.force(found.time)).max() < 1e-8 * form.peak_force
    sampled = found.sampled()
    inside = sampled.time < form.contact_time
    error = sampled.value - form.force(sampled.time)
    assert np.abs(error[inside]).max() < 1e-8 * form.peak_force
    assert sampled.value[sampled.time < 0.0].max() == 0.0
    assert (sampled.time[0], sampled.time[-1]) == pytest.approx((-1e-3, 5e-3))


@pytest.mark.parametrize("ratio", [0.0, 0.6, 1.5])
def test_another_ball_through_the_context(plate, ratio) -> None:
    """Other kb, cb and mass on the same Diagram, also elastic and overdamped."""
    kb, mass, speed = 30e3, 0.045, 12.0
    oracle = Oscillator(mass, kb, 2.0 * ratio * np.sqrt(kb * mass), speed)
    check(plate.run(speed, with_law(kb, oracle.damping, mass)), oracle, 1e-6)


def test_runs_do_not_depend_on_each_other(plate) -> None:
    first = plate.run(20.0)
    plate.run(30.0, with_law(30e3, 5.0))
    again = plate.run(20.0)
    assert (first.restitution, first.peak_force) == (again.restitution, again.peak_force)


def test_published_growth_and_force_axis() -> None:
    data = plate_dataset((18.0, 33.0))
    kb, cb = data["kb"].to_numpy(), data["cb"].to_numpy()
    assert kb[1] / kb[0] == pytest.approx(1.52, abs=1e-9)
    assert cb[1] / cb[0] == pytest.approx(1.97, abs=1e-9)
    assert float(data["peak_force"][1]) == pytest.approx(1710.0, abs=10.0)
    assert float(data["force"].max()) < 2000.0
    assert float(data["contact_time"].max()) < 5e-3
    for variable in data.variables.values():
        assert variable.attrs["units"]
        assert variable.attrs["long_name"]
    for name in ("contact_time", "peak_force", "restitution", "impulse", "rebound_speed"):
        np.testing.assert_allclose(data[name], data[f"{name}_closed_form"], rtol=1e-6)


@settings(max_examples=40, deadline=None)
@given(
    speed=st.floats(18.0, 33.0),
    rate=st.floats(20e3, 200e3),
    shift=st.floats(0.0, 1.0),
    offset=st.floats(-10.0, 10.0),
)
def test_analysis_of_a_sampled_force(speed, rate, shift, offset) -> None:
    """A record that starts anywhere and samples anywhere: known to one sample, as documented."""
    kb, cb = kb_cb(load_ball(), speed)
    form = closed_form(mass=0.059, stiffness=kb, damping=cb, speed=speed)
    time = np.arange(-1e-3, 6e-3, 1.0 / rate) + shift / rate
    signal = Signal(time + offset, form.force(time), "force", "N")
    found = analyse_force(signal, mass=0.059, approach_speed=speed)
    step = 1.0 / rate
    below = (
        0.012 * form.peak_force / abs(slope_at_release(form))
    )  # s under the threshold at the end
    assert found.contact_time == pytest.approx(form.contact_time, abs=1.1 * step + below)
    assert found.start == pytest.approx(offset, abs=step)
    assert found.peak_force == pytest.approx(form.peak_force, rel=2e-3)
    assert found.peak_time + found.start == pytest.approx(offset + form.peak_time, abs=step)
    missed = cb * speed * step + 0.02 * form.peak_force * below
    assert found.impulse == pytest.approx(form.impulse, abs=missed)
    assert found.restitution == pytest.approx(form.restitution, abs=missed / (0.059 * speed))
    assert found.samples == pytest.approx(form.contact_time * rate, abs=2 + below * rate)


def slope_at_release(form) -> float:
    h = 1e-4 * form.contact_time
    return float(form.force(form.contact_time - h)) / h


def test_noise_below_the_threshold_is_not_contact() -> None:
    form = closed_form(mass=0.059, stiffness=45e3, damping=14.0, speed=18.0)
    time = sample_times(65e3, 2e-3, 8e-3)
    noise = np.random.default_rng(5).normal(0.0, 5.0, len(time))
    signal = Signal(time, form.force(time) + noise, "force", "N")
    found = analyse_force(signal, mass=0.059, approach_speed=18.0, threshold=0.03)
    assert found.restitution == pytest.approx(form.restitution, abs=0.01)
    assert found.contact_time == pytest.approx(form.contact_time, abs=5e-5)


def test_bad_numbers_and_signals_are_refused(plate) -> None:
    form = closed_form(mass=0.059, stiffness=45e3, damping=14.0, speed=18.0)

    def signal(rate: float, end: float = 5e-3, sign: float = 1.0) -> Signal:
        time = np.arange(-1e-3, end, 1.0 / rate)
        return Signal(time, sign * form.force(time), "force", "N")

    good = {"mass": 0.059, "approach_speed": 18.0}
    for bad, options, words in (
        (signal(5e3), good, "at least 20"),
        (signal(65e3, 2e-3), good, "whole contact"),
        (signal(65e3, sign=-1.0), good, "positive"),
        (signal(65e3), good | {"mass": 0.0}, "mass"),
        (signal(65e3), good | {"approach_speed": np.nan}, "approach_speed"),
        (signal(65e3), good | {"threshold": 0.9}, "threshold"),
    ):
        with pytest.raises(InputError, match=words):
            analyse_force(bad, **options)
    with pytest.raises(InputError, match="speed"):
        plate.run(np.nan)
    with pytest.raises(InputError, match="each once"):
        plate_dataset((20.0, 20.0))
    with pytest.raises(InputError, match="rate"):
        plate_dataset((20.0,), rate=10.0)
    for key in ("mass", "stiffness", "speed"):
        numbers = {"mass": 1.0, "stiffness": 1.0, "damping": 1.0, "speed": 1.0} | {key: 0.0}
        with pytest.raises(InputError, match=key):
            closed_form(**numbers)


@pytest.mark.slow
def test_study_writes_what_it_found_and_reads_a_signal(plate, tmp_path) -> None:
    impact = plate.run(25.0)
    write_signal(impact.sampled(), tmp_path / "plate.csv")
    out = tmp_path / "out"
    options = ["--out", str(out), "--speeds", "18", "33", "--approach-speed", "25"]
    command = [sys.executable, str(STUDY), *options, "--signal", str(tmp_path / "plate.csv")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    read = float(done.stdout.split("restitution ")[-1].split()[0])
    assert read == pytest.approx(impact.restitution, abs=0.006)  # of one sample's impulse
    data = xr.open_dataset(out / "force_plate.nc")
    assert data["restitution"].to_numpy() == pytest.approx([0.6747, 0.5481], abs=1e-3)
    assert data["force"].attrs["units"] == "N"
    table = (out / "force_plate.csv").read_text().splitlines()
    assert table[0].startswith("speed [m/s],kb [N/m],cb [N*s/m],contact_time [s]")
    assert len(table) == 3
    history = read_signal(out / "force_history.csv", "force_33.0", "N")
    np.testing.assert_allclose(history.value, data["force"].sel(speed=33.0), rtol=1e-10)
    assert (out / "force_plate.png").stat().st_size > 20_000


BAD_SIGNALS = {
    "time [s],force [V]\n0,0\n": "force [V]",
    "": "empty",
    "time [s],force [N]\n0,0\n": "at least 20",
}


@pytest.mark.parametrize(("text", "words"), BAD_SIGNALS.items())
def test_study_refuses_a_bad_signal_before_it_writes(
    tmp_path, monkeypatch, capsys, text, words
) -> None:
    bad, out = tmp_path / "bad.csv", tmp_path / "out"
    bad.write_text(text)
    options = ["--out", str(out), "--signal", str(bad), "--approach-speed", "25"]
    monkeypatch.setattr(sys, "argv", [str(STUDY), *options])
    with pytest.raises(SystemExit) as left:
        runpy.run_path(str(STUDY), run_name="__main__")
    error = capsys.readouterr().err
    assert left.value.code == 2
    assert len(error.splitlines()) == 1
    assert words in error
    assert not out.exists()


def test_figure_shows_the_data() -> None:
    data = plate_dataset((18.0, 40.0))  # one beyond the identified speeds
    figure = force_plate_figure(data, make_force_plate().run(20.0).sampled())
    forces = figure.axes[0].get_lines()
    np.testing.assert_allclose(forces[0].get_ydata(), data["force"].sel(speed=18.0))
    assert [axes.get_ylabel() for axes in figure.axes[1:]] == [
        "peak force (N)",
        "contact time (ms)",
        "restitution",
    ]


def test_the_slow_ball_rebounds_as_the_rule_says_and_less_the_faster_it_is():
    plate, slow = make_force_plate(), load_ball("penn_titanium_slow")
    drop = plate.run(7.058, slow).restitution
    assert drop == pytest.approx(0.745, abs=1e-4)
    found = [plate.run(speed, slow).restitution for speed in (7.058, 10.0, 14.0, 18.0)]
    assert np.all(np.diff(found) < -0.02)
    assert found[-1] == pytest.approx(plate.run(18.0).restitution, abs=1e-6)


def stiffening(**numbers: float):
    """The shipped ball with normal law hunt_crossley and some of its numbers."""
    ball = load_ball(normal="hunt_crossley")
    law = ball.hunt_crossley
    own = {k: dataclasses.replace(getattr(law, k), value=v) for k, v in numbers.items()}
    return dataclasses.replace(ball, hunt_crossley=dataclasses.replace(law, **own))


@pytest.mark.parametrize("speed", [2.0, 25.0])
def test_hunt_and_crossleys_own_law_has_their_restitution(plate, speed) -> None:
    """With l = db v / kb, from m v dv = -x (kb + db v) dx: l (1 + e) = ln((1 + l) / (1 - l e))."""
    ball = stiffening(stiffness=3e4, stiffness_rise=0.0, damping=0.0, damping_rise=900.0)
    steps = IntegratorSettings(maximum_step=5e-6, error_control=False)
    found = plate.run(speed, ball, settings=steps)
    e, ratio = found.restitution, 900.0 * speed / 3e4
    assert ratio * (1.0 + e) == pytest.approx(np.log((1.0 + ratio) / (1.0 - ratio * e)), rel=1e-5)
    assert found.force[0] == pytest.approx(0.0, abs=1e-6)  # none at touch


def test_the_shipped_constants_leave_what_their_source_says() -> None:
    found = plate_dataset((7.058, 18.0, 33.0), load_ball(normal="hunt_crossley"))
    linear = plate_dataset((18.0, 33.0))
    e, time = found["restitution"].to_numpy(), found["contact_time"].to_numpy()
    off = np.array([e[0] - 0.745, *(e[1:] - linear["restitution"].to_numpy())])
    assert off == pytest.approx([0.012, -0.030, 0.018], abs=6e-4)
    shares = time[1:] / linear["contact_time"].to_numpy() - 1.0
    assert shares == pytest.approx([-0.03, 0.03], abs=5e-3)
    assert "force_closed_form" not in found


def test_a_record_that_begins_in_contact_counts_from_there():
    time = 0.5 + np.arange(0.0, 0.01, 5e-5)
    force = np.clip(100.0 - 4e4 * (time - 0.5), 0.0, None)  # a triangle of 2.5 ms
    found = analyse_force(Signal(time, force, "force", "N"), mass=0.05, approach_speed=1.0)
    assert found.start == 0.5
    assert found.contact_time == pytest.approx(0.99 * 2.5e-3, rel=1e-6)
    assert found.impulse == pytest.approx(0.125, rel=1e-3)
