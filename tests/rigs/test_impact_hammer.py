"""The impact hammer against the linear two-body racket, which has a closed form."""

from __future__ import annotations

import dataclasses
import runpy
import sys

import numpy as np
import pytest
import xarray as xr
from pydrake.autodiffutils import AutoDiffXd
from pydrake.common.value import AbstractValue

from drake_racket.io.errors import InputError
from drake_racket.io.signals import Signal, read_signal
from drake_racket.laws.compilation import HAS_NUMBA
from drake_racket.parameters.overrides import apply_overrides
from drake_racket.parameters.racket import load_racket
from drake_racket.plots.rigs.impact_hammer import hammer_figure
from drake_racket.rigs.hammer.force import half_sine, sampled_pulse
from drake_racket.rigs.hammer.impact_hammer import (
    DIRECTIONS,
    STEP,
    hammer_dataset,
    make_hammer_rig,
)
from drake_racket.rigs.hammer.ringing import analyse_ringing
from drake_racket.rigs.modes.bending import acceleration_signal, bending_mode
from studies.impact_hammer import ringing_dataset
from tests.conftest import ROOT, write_signal
from tests.oracles.hammered_racket import HammeredRacket
from tests.oracles.two_body import free_free_frequency, reduced_inertia

STUDY = ROOT / "studies" / "impact_hammer.py"
CASES = [(r, d) for r in ("tour", "recreational") for d in DIRECTIONS]


def bodies(name: str, direction: str) -> tuple[float, ...]:
    """m1, l1, c1, I1, m2, c2, I2 as the oracles take them."""
    p = load_racket(name)
    moment = "moi_frontal" if direction == "in_plane" else "moi_transverse"
    handle, head = p.handle, p.head
    first = (handle.mass, handle.length, handle.com, getattr(handle, moment))
    return tuple(q.value for q in (*first, head.mass, head.com, getattr(head, moment)))


def oracle(name: str, direction: str, place: float, reading: str = "by_axis") -> HammeredRacket:
    joint = load_racket(name, joint_reading=reading).throat_joint
    return HammeredRacket(*bodies(name, direction), *getattr(joint, direction)(), place)


def triangle(rate: float, start: float = 0.0) -> Signal:
    """A pulse that is straight between its samples, with its corners on samples."""
    time = np.arange(81) / rate
    force = np.interp(time, [0.0, 30 / rate, 50 / rate], [0.0, 2.0, 0.0])
    return Signal(time + start, force, "force", "N")


# the oracle itself


def test_oracle_by_modes_equals_the_state_space_solution() -> None:
    racket = oracle("tour", "out_of_plane", 0.1)
    time = np.arange(20001) * 1e-6
    force = np.where(time <= 1.3e-3, 100.0 * np.sin(np.pi * time / 1.3e-3), 0.0)
    modes = racket.half_sine(time, 100.0, 1.3e-3)
    straight = racket.straight_pulse(time, force)
    assert np.abs(modes - straight).max() < 3e-6 * np.abs(modes).max()  # chords of the sine


def test_oracle_has_the_frequency_of_two_bodies() -> None:
    _, w, sigma = oracle("tour", "in_plane", 0.1).modes()
    inertia = reduced_inertia(*bodies("tour", "in_plane"))
    frequency = free_free_frequency(*bodies("tour", "in_plane"), 1650.0)
    assert w / (2 * np.pi) == pytest.approx(frequency, rel=1e-10)
    assert sigma == pytest.approx(0.5 * 0.09 / inertia, rel=1e-9)


# the rig


@pytest.mark.parametrize(("name", "direction"), CASES)
def test_acceleration_of_a_small_hit_equals_the_closed_form(name, direction) -> None:
    """1 N: the plant is not linear, and what it adds grows with the cube of the hit."""
    place = 0.06
    hit = half_sine(1.0, 1.3e-3)
    strike = hammer_dataset(load_racket(name), direction, hit, place=place, duration=0.06)
    expected = oracle(name, direction, place).half_sine(strike["time"].to_numpy(), 1.0, 1.3e-3)
    error = np.abs(strike["acceleration"].to_numpy() - expected)
    assert error.max() < 1e-6 * np.abs(expected).max()
    after = strike["time"].to_numpy() > 1.3e-3
    assert error[after].max() < 3e-6 * np.abs(expected[after]).max()


def test_what_the_linear_model_leaves_out_grows_with_the_cube_of_the_hit() -> None:
    """The opposite hit gives the opposite acceleration: no even powers."""
    rig = make_hammer_rig(load_racket("tour"), "in_plane", place=0.06)
    errors = []
    for peak in (50.0, 100.0):
        strike = rig.run(half_sine(peak, 1.3e-3), duration=0.02)
        time = strike["time"].to_numpy()
        linear = oracle("tour", "in_plane", 0.06).half_sine(time, peak, 1.3e-3)
        errors.append(np.abs(strike["acceleration"].to_numpy() - linear).max())
    assert errors[1] / errors[0] == pytest.approx(8.0, rel=0.01)


@pytest.mark.parametrize("start", [0.0, -0.37])
def test_a_sampled_pulse_in_its_own_time(start) -> None:
    """Knots at 30 kHz fall between the samples at 20 kHz: the steps end at both."""
    signal = triangle(30e3, start)
    strike = hammer_dataset(
        load_racket("tour"), "out_of_plane", sampled_pulse(signal), place=0.06, duration=0.03
    )
    time = np.arange(1801) / 60e3
    force = np.interp(time, signal.time - start, signal.value, right=0.0)
    expected = oracle("tour", "out_of_plane", 0.06).straight_pulse(time, force)[::3]
    np.testing.assert_allclose(strike["time"].to_numpy() - start, time[::3], atol=1e-12)
    np.testing.assert_allclose(strike["force"].to_numpy(), force[::3], atol=1e-9)
    error = np.abs(strike["acceleration"].to_numpy() - expected).max()
    assert error < 3e-6 * np.abs(expected).max()


@pytest.mark.parametrize(("name", "direction"), CASES)
def test_impulse_is_the_change_of_momentum(name, direction) -> None:
    strike = hammer_dataset(load_racket(name), direction, duration=0.02)
    momentum, after = strike["momentum"].to_numpy(), strike["time"].to_numpy() >= 1e-3
    assert strike.attrs["pulse_impulse_N_s"] == pytest.approx(0.2 / np.pi, rel=1e-12)
    assert momentum[0] == 0.0
    # the hit turns with the handle, by a milliradian: cosine within 1e-6
    np.testing.assert_allclose(momentum[after], 0.2 / np.pi, rtol=1e-6)


PUBLISHED = {"tour": (158.0, 132.0), "recreational": (178.0, 150.0)}
FREQUENCIES = {
    ("tour", "by_axis"): (154.6, 128.5),
    ("recreational", "by_axis"): (181.3, 148.6),
    ("tour", "as_printed"): (114.8, 173.1),
    ("recreational", "as_printed"): (140.1, 192.3),
}


@pytest.mark.parametrize(("name", "reading"), list(FREQUENCIES))
def test_ringing_has_the_frequency_and_damping_of_the_joint(name, reading) -> None:
    racket = load_racket(name, joint_reading=reading)
    strikes = {d: hammer_dataset(racket, d, duration=0.06, rate=10e3) for d in DIRECTIONS}
    table = ringing_dataset(strikes, racket)
    for i, direction in enumerate(DIRECTIONS):
        stiffness, damping = getattr(racket.throat_joint, direction)()
        inertia = reduced_inertia(*bodies(name, direction))
        ratio = damping / (2.0 * np.sqrt(stiffness * inertia))
        row = table.sel(direction=direction)
        undamped = float(row["fit_frequency"]) / np.sqrt(1.0 - ratio**2)
        assert undamped == pytest.approx(FREQUENCIES[name, reading][i], abs=0.06)
        frequency = free_free_frequency(*bodies(name, direction), stiffness)
        assert undamped == pytest.approx(frequency, rel=5e-6)
        assert float(row["frequency"]) == pytest.approx(float(row["fit_frequency"]), rel=5e-5)
        assert float(row["damping_ratio"]) == pytest.approx(ratio, rel=1e-3)
        assert float(row["fit_damping_ratio"]) == pytest.approx(ratio, rel=2e-5)
        delta = 2.0 * np.pi * ratio / np.sqrt(1.0 - ratio**2)
        assert float(row["logarithmic_decrement"]) == pytest.approx(delta, rel=1e-3)
        assert float(row["published_frequency"]) == PUBLISHED[name][i]
    if reading == "by_axis":
        gap = np.abs(table["frequency"] / table["published_frequency"] - 1.0)
        assert float(gap.max()) < 0.03


@pytest.mark.parametrize(("name", "direction"), CASES)
def test_bending_mode_equals_the_two_body_derivation(name, direction) -> None:
    mode = bending_mode(load_racket(name), direction)
    phi, w, sigma = oracle(name, direction, 0.0).modes()
    assert mode.frequency == pytest.approx(w / (2 * np.pi), rel=1e-9)
    assert mode.damping_ratio == pytest.approx(sigma / w, rel=1e-9)
    assert mode.inertia == pytest.approx(reduced_inertia(*bodies(name, direction)), rel=1e-9)
    assert mode.motion**2 / mode.inertia == pytest.approx(phi[2] ** 2, rel=1e-9)
    assert oracle(name, direction, mode.node).modes()[0][2] == pytest.approx(0.0, abs=1e-9)


def test_a_short_hit_rings_as_strongly_as_the_mode_says_and_not_at_the_node() -> None:
    racket = load_racket("tour")
    mode = bending_mode(racket, "out_of_plane")
    short = half_sine(1.0, 1e-4)
    rig = make_hammer_rig(racket, "out_of_plane", short, place=0.02)
    found = analyse_ringing(acceleration_signal(rig.run(duration=0.05)), start=1e-4)
    assert found.amplitude == pytest.approx(
        short.impulse * mode.ringing_per_impulse(0.02), rel=3e-3
    )
    at_node = make_hammer_rig(racket, "out_of_plane", short, place=mode.node).run(duration=0.02)
    after = at_node["acceleration"].to_numpy()[at_node["time"].to_numpy() > 1e-4]
    assert np.abs(after).max() < 1e-6 * found.amplitude


def test_joint_constants_and_pulse_vary_on_one_diagram() -> None:
    racket = load_racket("recreational")
    rig = make_hammer_rig(racket, "in_plane", place=0.06)
    first = rig.run(duration=0.02)
    changed = rig.run(half_sine(1.0, 2e-3), joint=(1000.0, 0.2), duration=0.02)
    other = dataclasses.replace(
        oracle("recreational", "in_plane", 0.06), k=1000.0, c_joint=0.2
    ).half_sine(changed["time"].to_numpy(), 1.0, 2e-3)
    assert np.abs(changed["acceleration"] - other).max() < 1e-6 * np.abs(other).max()
    xr.testing.assert_identical(first, rig.run(duration=0.02))


def test_dataset_is_labelled() -> None:
    strike = hammer_dataset(load_racket("tour"), "in_plane", duration=0.01, rate=10e3)
    assert strike.sizes == {"time": 101}
    for variable in strike.variables.values():
        assert variable.attrs["units"]
        assert variable.attrs["long_name"]
    force, time = strike["force"].to_numpy(), strike["time"].to_numpy()
    expected = np.where(time <= 1e-3, 100.0 * np.sin(np.pi * time / 1e-3), 0.0)
    np.testing.assert_allclose(force, expected, atol=1e-9)
    assert strike.attrs["place_m"] == 0.1
    assert abs(float(strike["joint_angle"][-1])) > 0.0


@pytest.mark.parametrize("kind", ["half_sine", "sampled"])
def test_hammer_force_on_autodiff(kind) -> None:
    """The derivative of the force by time and by its size, on a tilted racket."""
    pulse = half_sine(50.0, 2e-3) if kind == "half_sine" else sampled_pulse(triangle(30e3))
    rig = make_hammer_rig(load_racket("tour"), "out_of_plane", pulse)
    system = rig.hammer.ToAutoDiffXd()
    context = system.CreateDefaultContext()
    state = rig.plant.GetPositionsAndVelocities(rig.plant.CreateDefaultContext())
    state[:4] = [np.cos(0.3), np.sin(0.3), 0.0, 0.0]  # z of the handle: (0, -sin 0.6, cos 0.6)
    system.GetInputPort("state").FixValue(context, [AutoDiffXd(x) for x in state])
    context.SetTime(AutoDiffXd(0.4e-3, [1.0, 0.0]))
    numbers = pulse.numbers.copy()
    scaled = slice(0, 1) if kind == "half_sine" else slice(len(numbers) // 2, None)
    values = [AutoDiffXd(x, [0.0, 0.0]) for x in numbers]
    values[scaled] = [AutoDiffXd(x, [0.0, x]) for x in numbers[scaled]]
    context.get_mutable_numeric_parameter(system.PULSE).SetFromVector(values)
    force = system.GetOutputPort("force").Eval(context)[0]
    if kind == "half_sine":
        size, rate = 50.0 * np.sin(0.2 * np.pi), 50.0 * np.pi / 2e-3 * np.cos(0.2 * np.pi)
    else:
        size, rate = 2.0 * 0.4, 2.0 / 1e-3
    assert force.value() == pytest.approx(size, rel=1e-9)
    assert force.derivatives() == pytest.approx([rate, size], rel=1e-9)
    (applied,) = system.GetOutputPort("spatial_forces").Eval(context)
    world = np.array([x.value() for x in applied.F_Bq_W.translational()])
    np.testing.assert_allclose(world, size * np.array([0.0, -np.sin(0.6), np.cos(0.6)]), atol=1e-9)
    np.testing.assert_allclose([float(x.value()) for x in applied.p_BoBq_B], [0.1, 0.0, 0.0])


@pytest.mark.skipif(not HAS_NUMBA, reason="the compiled engine without numba is slow")
@pytest.mark.parametrize(("segments", "start"), [(2, 0.0), (4, -0.37)])
def test_the_compiled_engine_takes_the_same_steps_as_drake(segments, start) -> None:
    racket = apply_overrides(load_racket("recreational"), {"racket.frame.segments": segments})
    pulse = sampled_pulse(triangle(30e3, start)) if start else half_sine(500.0, 1.03e-3)
    rig = make_hammer_rig(racket, "in_plane", pulse, place=0.06)
    compiled = rig.run(duration=0.012, engine="compiled")
    drake = rig.run(duration=0.012, engine="drake")
    for name, array in drake.items():
        error = np.abs(compiled[name] - array).max() / np.abs(array).max()
        assert error < (1e-12 if segments == 2 else 1e-6), name
    xr.testing.assert_identical(compiled, rig.run(duration=0.012))


def test_hammer_force_is_zero_outside_the_pulse() -> None:
    for pulse in (half_sine(), sampled_pulse(triangle(30e3))):
        rig = make_hammer_rig(load_racket("tour"), "in_plane", pulse)
        context = rig.hammer.CreateDefaultContext()
        for time in (-1e-6, 0.0101):
            context.SetTime(time)
            assert rig.hammer.GetOutputPort("force").Eval(context)[0] == 0.0
    assert isinstance(rig.hammer.GetOutputPort("spatial_forces").Allocate(), AbstractValue)


# bad input


def test_bad_numbers_are_refused() -> None:
    racket = load_racket("tour")
    rig = make_hammer_rig(racket, "in_plane")
    late = make_hammer_rig(racket, "in_plane", sampled_pulse(triangle(30e3, -0.37)))
    for call, words in (
        (lambda: half_sine(0.0), "peak"),
        (lambda: half_sine(np.nan), "peak"),
        (lambda: half_sine(1e4), "peak"),
        (lambda: half_sine(1.0, 1.0), "length"),
        (lambda: make_hammer_rig(racket, "sideways"), "in_plane, out_of_plane"),
        (lambda: make_hammer_rig(racket, "in_plane", place=0.4), "place"),
        (lambda: rig.run(engine="mujoco"), "engine"),
        (lambda: rig.run(engine="compiled", settings=STEP), "engine"),
        (lambda: rig.run(duration=5e-4), "duration"),
        (lambda: late.run(duration=1e-3), "duration: got 0.001; allowed: longer than the pulse's"),
        (lambda: rig.run(duration=1.001), "duration"),
        (lambda: rig.run(rate=999.0), "rate"),
        (lambda: rig.run(rate=2.001e5), "rate"),
        (lambda: rig.run(rate=10.0), "rate"),
        (lambda: rig.run(joint=(np.nan, 0.0)), "kf"),
        (lambda: rig.run(joint=(1.0, -1.0)), "cf"),
        (lambda: rig.run(sampled_pulse(triangle(30e3))), "kind"),
    ):
        with pytest.raises(InputError, match=words) as caught:
            call()
        assert len(str(caught.value).splitlines()) == 1


def test_bad_pulses_are_refused() -> None:
    good = triangle(30e3)

    def changed(time=good.time, value=good.value) -> Signal:
        return Signal(time, value, "force", "N")

    for signal, words in (
        (changed(value=0.0 * good.value), "positive"),
        (changed(value=1e4 * good.value), "5000 N"),
        (changed(good.time[::4], good.value[::4]), "at least 20"),
        (changed(good.time[:40], good.value[:40]), "whole pulse"),
        (changed(good.time[10:], good.value[10:]), "whole pulse"),
        (changed(100.0 * good.time), "0.05 s"),
        (changed(np.arange(60_000) * 1e-6, np.ones(60_000)), "at most 50000"),
    ):
        with pytest.raises(InputError, match=words):
            sampled_pulse(signal)


# study


@pytest.fixture
def study(monkeypatch):
    """Runs the script in this process (a new one takes seconds to import)."""

    def run(*arguments: object) -> None:
        monkeypatch.setattr(sys, "argv", [str(STUDY), *map(str, arguments)])
        runpy.run_path(str(STUDY), run_name="__main__")

    return run


def test_study_writes_what_it_found(study, tmp_path, capsys) -> None:
    study("--out", tmp_path / "out", "--duration", 0.05, "--rate", 5000)
    assert "peak inferred, length inferred" in capsys.readouterr().out
    data = xr.open_dataset(tmp_path / "out" / "impact_hammer.nc")
    assert list(data["direction"].to_numpy()) == ["in_plane", "out_of_plane"]
    assert data["frequency"].to_numpy() == pytest.approx([154.57, 128.53], abs=0.05)
    assert data["acceleration"].attrs["units"] == "m/s^2"
    back = read_signal(tmp_path / "out" / "in_plane.csv", "acceleration", "m/s^2")
    np.testing.assert_allclose(back.value, data["acceleration"][0], rtol=1e-10, atol=1e-12)
    table = (tmp_path / "out" / "ringing.csv").read_text().splitlines()
    assert table[0].startswith("direction,frequency [Hz]")
    assert len(table) == 3
    assert (tmp_path / "out" / "impact_hammer.png").stat().st_size > 20_000


def test_study_takes_a_pulse(study, tmp_path, capsys) -> None:
    write_signal(triangle(30e3), tmp_path / "hit.csv")
    options = ("--direction", "in_plane", "--duration", 0.03, "--joint-reading", "as_printed")
    study("--out", tmp_path / "out", "--pulse", tmp_path / "hit.csv", *options)
    assert "measured" in capsys.readouterr().out
    data = xr.open_dataset(tmp_path / "out" / "impact_hammer.nc")
    assert float(data["frequency"][0]) == pytest.approx(114.8, abs=0.1)
    assert float(data["force"].max()) == pytest.approx(2.0, abs=0.05)


BAD_STUDIES = {
    "unit": ("time [min],force [N]\n0,0\n", (), "time [min]"),
    "coarse": ("time [s],force [N]\n" + "".join(f"{i * 1e-4},{max(0, 3 - i)}\n" for i in range(30)),
               (), "at least 20"),
    "both": ("time [s],force [N]\n0,0\n", ("--peak", 5), "no --peak"),
}  # fmt: skip


@pytest.mark.parametrize("case", list(BAD_STUDIES))
def test_study_refuses_bad_pulses_before_it_writes(study, tmp_path, capsys, case) -> None:
    text, options, words = BAD_STUDIES[case]
    (tmp_path / "bad.csv").write_text(text)
    with pytest.raises(SystemExit) as left:
        study("--out", tmp_path / "out", "--pulse", tmp_path / "bad.csv", *options)
    error = capsys.readouterr().err
    assert left.value.code == 2
    assert len(error.splitlines()) == 1
    assert words in error
    assert not (tmp_path / "out").exists()


def test_figure_shows_the_data() -> None:
    racket = load_racket("recreational")
    strikes = {d: hammer_dataset(racket, d, duration=0.04, rate=5e3) for d in DIRECTIONS}
    ringing = {d: analyse_ringing(acceleration_signal(s), start=1e-3) for d, s in strikes.items()}
    figure = hammer_figure(strikes, ringing, {"in_plane": 178.0, "out_of_plane": np.nan}, "a note")
    whole = figure.axes[2].get_lines()[0]
    np.testing.assert_allclose(whole.get_ydata(), strikes["in_plane"]["acceleration"])
    labels = [t.get_text() for t in figure.axes[6].get_legend().get_texts()]
    assert labels[-1] == "published 178 Hz"
    assert len(figure.axes[7].get_legend().get_texts()) == 1
    assert "a note" in figure.get_suptitle()
