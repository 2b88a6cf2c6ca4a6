"""kf and cf from hammer records: the linear racket, recovery from Drake, coverage, refusals."""

from __future__ import annotations

import dataclasses
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_racket.identify.core.least_squares import fit
from drake_racket.identify.frame import fit as frame_fit
from drake_racket.identify.frame.checks import frame_warnings
from drake_racket.identify.frame.drake_difference import check_rates
from drake_racket.identify.frame.fit import fit_frame, hammer_record, read_hammer_record
from drake_racket.identify.frame.hammer_model import HammeredFrame, hammered_frame
from drake_racket.identify.frame.ringing_problem import RingingProblem
from drake_racket.identify.report.frame_figures import frame_fit_figure
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Progress
from drake_racket.io.signals import Signal
from drake_racket.parameters.overrides import apply_overrides
from drake_racket.parameters.racket import load_racket
from drake_racket.rigs.hammer.force import half_sine
from drake_racket.rigs.hammer.impact_hammer import DIRECTIONS, make_hammer_rig
from drake_racket.rigs.modes.bending import bending_mode
from tests.rigs.test_impact_hammer import CASES, oracle

RATE, PLACE = 20e3, 0.06
STEP = 1.0 / RATE
TIME = np.arange(-40, 1200) * STEP
HIT = 500.0 * np.sin(np.pi * np.clip(TIME, 0.0, 1e-3) / 1e-3)


def racket(name: str = "tour", reading: str | None = None):
    return load_racket(name, joint_reading=reading)


def truth(direction: str, name: str = "tour") -> tuple[float, float]:
    return getattr(racket(name).throat_joint, direction)()


@pytest.fixture(scope="module")
def frames() -> dict[str, HammeredFrame]:
    return {d: hammered_frame(racket(), d, PLACE) for d in DIRECTIONS}


def linear(frame, direction, *, force=HIT) -> np.ndarray:
    kf, cf = truth(direction)
    return frame.acceleration(force, STEP, stiffness=kf, damping=cf)


def record(force, acceleration, time=TIME, **options):
    return hammer_record(
        Signal(time, force, "force", "N"),
        Signal(time, acceleration, "acceleration", "m/s^2"),
        **options,
    )


def noisy(acceleration, seed, *, noise=3.0, force_noise=5.0):
    """1 % of the hammer's peak, and the accelerometer's m/s^2."""
    rng = np.random.default_rng(seed)
    return record(
        HIT + force_noise * rng.standard_normal(len(TIME)),
        acceleration + noise * rng.standard_normal(len(TIME)),
    )


def of_strike(strike):
    return record(*(strike[n].to_numpy() for n in ("force", "acceleration", "time")))


# the linear racket


@pytest.mark.parametrize(("name", "direction"), CASES)
def test_acceleration_equals_the_oracle(name, direction) -> None:
    """Matrix exponential of all three coordinates, masses written out by hand."""
    frame = hammered_frame(racket(name), direction, 0.1)
    kf, cf = truth(direction, name)
    found = frame.acceleration(HIT, STEP, stiffness=kf, damping=cf)
    expected = oracle(name, direction, 0.1).straight_pulse(TIME - TIME[0], HIT)
    assert np.abs(found - expected).max() < 1e-11 * np.abs(expected).max()
    mode = bending_mode(racket(name), direction)
    assert frame.inertia == pytest.approx(mode.inertia, rel=1e-12)
    assert frame.node == pytest.approx(mode.node, rel=1e-10)
    assert frame.participation == pytest.approx(1.0 - 0.1 / mode.node, rel=1e-10)


@settings(max_examples=6, deadline=None)
@given(
    kf=st.floats(300.0, 5e3), ratio=st.floats(1e-4, 0.8), delay=st.floats(-2e-4, 2e-4)
)  # fmt: skip
def test_derivatives_are_those_of_the_acceleration(kf, ratio, delay) -> None:
    # with a mode that rings and one that is damped beyond ringing
    frame = HammeredFrame(0.0014, -17.7, 7.0, 0.15, 0.3, ((1e-4, 25.0), (1e-6, -9.0)))
    x = np.array([kf, 2.0 * ratio * np.sqrt(kf * frame.inertia), delay])

    def bending(y):
        return frame.bending(HIT, STEP, stiffness=y[0], damping=y[1], delay=y[2])

    value, by = bending(x)
    for i, step in enumerate(np.diag([1e-4 * kf, 1e-3 * x[1], 1e-7])):
        near = bending(x + step)[0] - bending(x - step)[0]
        far = bending(x + 2 * step)[0] - bending(x - 2 * step)[0]
        found = (8.0 * near - far) / (12.0 * step[i])
        # differences of rounded numbers
        rounding = 1e-13 * np.abs(value).max() / step[i]
        assert np.abs(by[:, i] - found).max() < 1e-7 * np.abs(found).max() + rounding


@pytest.mark.parametrize("off", [0.0, 1e-15, -1e-13])
def test_a_higher_mode_at_its_critical_damping_is_between_its_neighbours(off) -> None:
    cf = 0.5
    kf = 0.25 * cf**2 / 1e-4  # critical for the higher mode alone

    def bending(share):
        frame = HammeredFrame(0.0014, 0.0, 7.0, 0.15, 0.3, ((1e-4, 25.0),))
        return frame.bending(HIT, STEP, stiffness=kf * (1.0 + share), damping=cf)

    (value, by), (low, low_by), (high, high_by) = bending(off), bending(-1e-4), bending(1e-4)
    assert np.abs(value - 0.5 * (low + high)).max() < 1e-6 * np.abs(value).max()
    for i in range(2):
        middle = 0.5 * (low_by + high_by)[:, i]
        # 0.1 %: of differences of exponents that are nearly one
        assert np.abs(by[:, i] - middle).max() < 2e-3 * np.abs(middle).max()


def test_a_delay_of_three_samples_moves_the_ringing_by_three_samples(frames) -> None:
    kf, cf = truth("in_plane")
    frame, joint = frames["in_plane"], {"stiffness": kf, "damping": cf}
    late, _ = frame.bending(HIT, STEP, **joint, delay=3 * STEP)
    plain, _ = frame.bending(HIT, STEP, **joint)
    np.testing.assert_allclose(late[80:], plain[77:-3], rtol=1e-9, atol=1e-9)


def test_jacobian_of_the_problem_is_that_of_its_residuals(frames) -> None:
    records = [noisy(linear(frames["in_plane"], "in_plane"), s) for s in (0, 1)]
    problem = RingingProblem(records, frames["in_plane"], (1500.0, 0.1))
    for p, record_ in zip(problem.parameters[3::2], records, strict=True):
        assert 0.0 < p.upper == -p.lower <= 0.5 * record_.pulse
    x = np.array([p.start for p in problem.parameters]) * 1.01 + 1e-6
    jacobian = problem.jacobian(x)
    for i, p in enumerate(problem.parameters):
        step = np.zeros(len(x))
        step[i] = 1e-5 * (p.upper - p.lower)
        found = (problem.residuals(x + step) - problem.residuals(x - step)) / (2.0 * step[i])
        assert np.abs(jacobian[:, i] - found).max() < 1e-5 * np.abs(found).max()


# recovery


def test_drake_at_1_kn_through_drake() -> None:
    """The linear model alone is off by the rig's departure from it; two passes are not."""
    rig = make_hammer_rig(racket(), "out_of_plane", half_sine(1000.0), place=PLACE)
    strike = of_strike(rig.run(duration=0.04, rate=10e3))
    told: list[Progress] = []
    found = fit_frame([strike], racket(), "out_of_plane", PLACE, progress=told.append)
    assert [now.done for now in told] == list(range(1, len(found.passes) + 1))
    assert {now.total for now in told} == {told[0].total}
    kf, cf = truth("out_of_plane")
    off = found.passes / [kf, cf] - 1.0
    assert 5e-5 < np.abs(off[0]).max() < 1e-3
    assert np.abs(off[-1]).max() < 1e-6
    assert found.kf.value == pytest.approx(kf, rel=1e-6)
    assert found.cf.value == pytest.approx(cf, rel=1e-6)
    assert found.relative_rms < 1e-6
    # half a sine through 10 samples has less impulse, drawn straight between them
    assert found.result.estimates[2] == pytest.approx(1.0 + np.pi**2 / 1200.0, abs=1e-4)


def test_six_segments_of_drake_give_the_joint_of_their_racket() -> None:
    """And the two segments of the same racket find the same frequency, with what they lack."""
    six = apply_overrides(racket(), {"racket.frame.segments": 6.0, "racket.frame.density": 0.5})
    rig = make_hammer_rig(six, "out_of_plane", half_sine(100.0), place=PLACE)
    strike = of_strike(rig.run(duration=0.03, rate=20e3))
    kf, cf = truth("out_of_plane")
    found = fit_frame([strike], six, "out_of_plane", PLACE, drake_passes=0)
    assert (found.kf.value, found.cf.value) == pytest.approx((kf, cf), rel=2e-5)
    assert found.relative_rms < 1e-4
    two = fit_frame([strike], racket(), "out_of_plane", PLACE, drake_passes=0)
    assert two.frequency.value == pytest.approx(found.frequency.value, rel=2e-3)
    assert two.relative_rms > 0.05


@pytest.mark.slow
@pytest.mark.parametrize(("name", "direction"), [CASES[0], CASES[3]])
def test_drake_at_mid_handle(name, direction) -> None:
    """The default place, at 1 kN: required are 0.1 % of kf and 1 % of cf."""
    rig = make_hammer_rig(racket(name), direction, half_sine(1000.0))
    found = fit_frame([of_strike(rig.run(rate=10e3))], racket(name), direction)
    kf, cf = truth(direction, name)
    assert found.kf.value == pytest.approx(kf, rel=1e-6)
    assert found.cf.value == pytest.approx(cf, rel=1e-5)


@pytest.mark.parametrize("direction", list(DIRECTIONS))
def test_strikes_share_kf_and_cf_whatever_their_gain_and_delay(frames, direction) -> None:
    frame, (kf, cf) = frames[direction], truth(direction)
    gains, delays, records = [0.97, 1.02], [2e-6, -30e-6], []
    for gain, delay in zip(gains, delays, strict=True):
        bending, _ = frame.bending(HIT, STEP, stiffness=kf, damping=cf, delay=delay)
        records.append(record(HIT, gain * (frame.direct * HIT + bending)))
    found = fit_frame(records, racket(), direction, PLACE, drake_passes=0)
    assert (found.kf.value, found.cf.value) == pytest.approx((kf, cf), rel=1e-8)
    np.testing.assert_allclose(found.result.estimates[2::2], gains, rtol=1e-8)
    np.testing.assert_allclose(found.result.estimates[3::2], delays, rtol=1e-6)
    mode = bending_mode(racket(), direction)
    assert found.frequency.value == pytest.approx(mode.frequency, rel=1e-8)
    assert found.damping_ratio == pytest.approx(mode.damping_ratio, rel=1e-8)
    # f goes as the root of kf
    share = np.array([*found.kf.interval, found.kf.value + found.kf.standard_error]) / kf - 1.0
    low, high = found.frequency.interval
    assert (low, high) == pytest.approx(mode.frequency * (1.0 + 0.5 * share[:2]), rel=1e-12)
    error = 0.5 * mode.frequency * share[2]
    assert found.frequency.standard_error == pytest.approx(error, rel=1e-6)
    once = fit_frame(records, racket(), direction, PLACE, drake_passes=0, starts=4)
    assert once.kf.value == pytest.approx(found.kf.value, rel=1e-9)


def test_rms_of_the_record_is_that_of_the_force_as_measured(frames) -> None:
    acceleration = linear(frames["in_plane"], "in_plane")
    found = fit_frame(
        [record(HIT, 1.02 * acceleration)], racket(), "in_plane", PLACE, drake_passes=0
    )
    size = np.sqrt(np.mean(found.records[0].acceleration ** 2))
    assert found.record_rms == pytest.approx(0.02 / 1.02 * size, rel=1e-6)
    assert found.rms < 1e-9 * size


def test_95_percent_intervals_cover_at_95_percent(frames) -> None:
    """40 strikes with noise on hammer and accelerometer; errors over standard errors of size 1."""
    expected = np.array(truth("out_of_plane"))
    acceleration = linear(frames["out_of_plane"], "out_of_plane")
    covered, scaled = np.zeros(2), []
    for seed in range(40):
        problem = RingingProblem(
            [noisy(acceleration, seed)], frames["out_of_plane"], (930.0, 0.035)
        )
        result = fit(problem, starts=1)
        low, high = result.confidence_intervals[:2].T
        covered += (low <= expected) & (expected <= high)
        scaled.append((result.estimates[:2] - expected) / result.standard_errors[:2])
    assert (covered >= 35).all()  # fewer: 1 % of the time, were they right
    assert np.sqrt(np.mean(np.square(scaled), axis=0)) == pytest.approx(1.0, abs=0.25)


@pytest.mark.slow
def test_the_whole_fit_covers_near_the_node() -> None:
    """Two strikes where the racket hardly rings; noise 10 % of the ringing."""
    expected = truth("in_plane")
    frame = hammered_frame(racket(), "in_plane", 0.178)
    acceleration, covered = linear(frame, "in_plane"), np.zeros(2)
    for seed in range(40):
        records = [noisy(acceleration, 2 * seed + i, noise=0.2) for i in (0, 1)]
        found = fit_frame(records, racket(), "in_plane", 0.178, drake_passes=0)
        for i, estimate in enumerate((found.kf, found.cf)):
            covered[i] += estimate.interval[0] <= expected[i] <= estimate.interval[1]
    assert (covered >= 35).all()


@pytest.mark.parametrize(
    ("reading", "direction", "label"),
    [
        ("by_axis", "in_plane", "out"),
        ("by_axis", "out_of_plane", "in"),
        ("as_printed", "in_plane", "in"),
        ("as_printed", "out_of_plane", "out"),
    ],
)
def test_fields_go_where_the_racket_reads_them(frames, reading, direction, label) -> None:
    records = [record(HIT, linear(frames[direction], direction))]
    found = fit_frame(records, racket(reading=reading), direction, PLACE, drake_passes=0)
    fields = found.fields()
    joint = racket(reading=reading).throat_joint
    for name, estimate in fields.items():
        quantity = dataclasses.replace(getattr(joint, name), value=estimate.value)
        joint = dataclasses.replace(joint, **{name: quantity})
    assert set(fields) == {f"stiffness_{label}", f"damping_{label}"}
    assert getattr(joint, direction)() == pytest.approx(truth(direction), rel=1e-8)


# warnings


def warnings_of(records, direction="in_plane", place=PLACE) -> str:
    return "\n".join(fit_frame(records, racket(), direction, place, drake_passes=0).warnings)


def test_a_place_near_the_node_is_said_with_its_number() -> None:
    frame = hammered_frame(racket(), "in_plane", 0.178)
    text = warnings_of([noisy(linear(frame, "in_plane"), 0, noise=0.05)], place=0.178)
    assert "moves 6.9 % as far as the butt" in text
    assert "0.48 % of the butt's ringing" in text


def test_what_the_racket_does_not_explain_is_said(frames) -> None:
    frame = frames["in_plane"]
    plain = linear(frame, "in_plane")
    after = TIME > 2e-3
    other = 60.0 * np.sin(2.0 * np.pi * 400.0 * TIME) * after
    for acceleration, words in (
        (1.2 * plain, "rings 1.2 times as strongly"),
        (np.interp(TIME - 2.5 * STEP, TIME, plain), "us after the force says"),
        (plain + 30.0, "take the offset away"),
        (plain + other, "neighbouring residuals are alike"),
        (plain + other, "% of the ringing's"),
    ):
        text = warnings_of([record(HIT, acceleration)])
        assert words in text
    assert warnings_of([noisy(plain, 0)]) == ""


def test_a_ringing_below_the_noise_starts_from_the_racket(frames, monkeypatch) -> None:
    asked = []

    def spy(problem, **options):
        asked.append(options["starts"])
        return whole(problem, **options)

    whole = frame_fit.fit
    monkeypatch.setattr(frame_fit, "fit", spy)
    frame = hammered_frame(racket(), "in_plane", 0.16648)  # the node, almost
    rng = np.random.default_rng(2)
    acceleration = linear(frame, "in_plane") + 5.0 * rng.standard_normal(len(TIME))
    short = record(HIT, acceleration, duration=0.02)
    found = fit_frame([short], racket(), "in_plane", 0.16648, drake_passes=0)
    text = "\n".join(found.warnings)
    assert "% of the ringing's" in text
    width = found.kf.interval[1] - found.kf.interval[0]
    assert not width < 0.1 * found.kf.value  # it does not pretend to know
    assert asked == [frame_fit.BLIND_STARTS]  # there is a minimum for every beat


def test_a_ringing_hidden_in_noise_is_found_from_another_rackets_joint() -> None:
    """Near the node; the racket's file says kf = 1000, the strikes were made with 1650."""
    acceleration = linear(hammered_frame(racket(), "in_plane", 0.178), "in_plane")
    other = racket()
    kf = dataclasses.replace(other.throat_joint.stiffness_out, value=1000.0)
    joint = dataclasses.replace(other.throat_joint, stiffness_out=kf)
    other = dataclasses.replace(other, throat_joint=joint)
    records = [noisy(acceleration, seed, noise=5.0) for seed in range(3)]
    found = fit_frame(records, other, "in_plane", 0.178, drake_passes=0)
    assert any("the racket's own kf and cf" in text for text in found.warnings)
    off = abs(found.kf.value - truth("in_plane")[0])
    assert off < min(3.0 * found.kf.standard_error, 0.03 * truth("in_plane")[0])


def doubts(frames, passes=((1.0, 1.0),), through=True, **changes):
    """Warnings of a made-up fit to one record that rings with a root mean square of 1."""
    ringing = np.tile([1.0, -1.0], 50)
    strike = SimpleNamespace(
        acceleration=ringing, after=0, step=STEP, offset=changes.get("offset", 0.0), where="it"
    )
    left = changes.get("left", 0.05 * np.ones(100))
    alike = changes.get("alike", 0.0)
    left = left * np.where(np.arange(100) % 2, 1.0, -1.0) if alike == 0.0 else left
    result = SimpleNamespace(
        residuals=left,
        rms=changes.get("rms", 0.05),
        estimates=np.array([1.0, 1.0, changes.get("gain", 1.0), changes.get("delay", 0.0)]),
        standard_errors=np.array([0.0, 0.0, *changes.get("errors", (0.0, 0.0))]),
    )
    frame = SimpleNamespace(participation=changes.get("participation", -1.0), node=0.1)
    return frame_warnings([strike], frame, 0.05, result, np.array(passes), through)


@pytest.mark.parametrize(
    ("within", "beyond", "told"),
    [
        ({"participation": -0.201}, {"participation": -0.199}, "from the mode's node"),
        ({"rms": 0.1}, {"rms": 0.1005}, "of the ringing's"),
        ({"gain": 1.0499}, {"gain": 1.0502}, "times as strongly"),
        ({"gain": 0.9501}, {"gain": 0.9498}, "times as strongly"),
        ({"gain": 1.3, "errors": (0.1001, 0.0)}, {"gain": 1.3, "errors": (0.0999, 0.0)}, "times"),
        ({"delay": -0.999 * STEP}, {"delay": -1.001 * STEP}, "us after the force says"),
        ({"delay": 1.0, "errors": (0.0, 0.334)}, {"delay": 1.0, "errors": (0.0, 0.333)}, " us "),
        ({"offset": -0.01999}, {"offset": -0.02001}, "take the offset away"),
        ({"passes": [(9.0, 0.5), (9.00899, 0.5)]}, {"passes": [(9.0, 0.5), (9.00901, 0.5)]}, "kf"),
        ({"passes": [(9.0, 0.5), (9.0, 0.49501)]}, {"passes": [(9.0, 0.5), (9.0, 0.49499)]}, "cf"),
        ({"passes": [(2.0, 1.0)]}, {"passes": [(1.0, 1.0), (2.0, 1.0)]}, "kf by 1e+02 %"),
        ({"passes": [(1.0, 1.0), (2.0, 1.0)], "through": False},
         {"passes": [(1.0, 1.0), (2.0, 1.0)]}, "take more passes"),
        ({"alike": 1, "rms": 0.001}, {"alike": 1, "rms": 0.00101}, "correlation 0.99"),
    ],
)  # fmt: skip
def test_doubts_begin_at_their_borders(frames, within, beyond, told) -> None:
    assert doubts(frames, **within) == []
    (line,) = doubts(frames, **beyond)
    assert told in line


@pytest.mark.parametrize(("correlation", "said"), [(0.29, False), (0.31, True)])
def test_neighbours_that_are_alike_are_doubted_from_three_tenths_on(frames, correlation, said):
    left = np.zeros(100)
    left[:2] = 1.0, (1.0 - np.sqrt(1.0 - 4.0 * correlation**2)) / (2.0 * correlation)
    assert bool(doubts(frames, left=left, alike=1)) == said


def test_drake_is_hit_with_the_pulse_that_was_measured(frames, monkeypatch) -> None:
    """To the first sample that is zero again; once built, a rig is kept."""
    from drake_racket.identify.frame import drake_difference

    pulses, built = [], []

    class Rig:
        def run(self, pulse, **options):
            pulses.append((pulse, options))
            return xarray.Dataset({"acceleration": ("time", np.full(len(good.force), 7.0))})

    def build(racket, direction, pulse, place):
        built.append((direction, place))
        return Rig()

    monkeypatch.setattr(drake_difference, "make_hammer_rig", build)
    frame, (kf, cf) = frames["in_plane"], truth("in_plane")
    good = noisy(linear(frame, "in_plane"), 0)
    difference = drake_difference.DrakeDifference(racket(), "in_plane", PLACE)
    found = difference.acceleration(good, frame, kf, cf, 1.1)
    made = frame.acceleration(1.1 * good.force, good.step, stiffness=kf, damping=cf)
    np.testing.assert_allclose(found, 7.0 - made)
    difference.acceleration(good, frame, kf, cf, 1.0)
    assert built == [("in_plane", PLACE)]
    (pulse, options), (again, _) = pulses
    time, force = pulse.numbers.reshape(2, -1)
    np.testing.assert_array_equal(force, 1.1 * good.force[: len(force)])
    assert force[-1] == 0.0 != force[-2]
    assert pulse.end == time[-1] == pytest.approx((len(force) - 1) * STEP)
    assert pulse.peak == max(force)
    assert pulse.impulse == pytest.approx(np.sum(0.5 * (force[1:] + force[:-1])) * STEP)
    assert again.peak == pytest.approx(pulse.peak / 1.1)
    assert options["joint"] == (kf, cf)
    assert options["duration"] == pytest.approx((len(good.force) - 1) * STEP)
    assert options["rate"] == pytest.approx(RATE)


@pytest.mark.parametrize(("rate", "refused"), [(999.0, 1), (1001.0, 0), (1.99e5, 0), (2.01e5, 1)])
def test_drake_takes_sample_rates_of_its_rig(rate, refused) -> None:
    strike = SimpleNamespace(step=1.0 / rate, where="it")
    with pytest.raises(InputError, match="sample rate") if refused else nullcontext():
        check_rates([strike])


# refusals


def changed(values, where, to):
    values = np.array(values)
    values[where] = to
    return values


def test_bad_records_are_refused(frames) -> None:
    good = linear(frames["in_plane"], "in_plane")
    uneven = TIME + 1e-5 * (np.arange(len(TIME)) % 2)
    for call, words in (
        (lambda: record(HIT, -good), "against the force"),
        (lambda: record(0.0 * HIT, good), "largest value"),
        (lambda: record(20.0 * HIT, good), "5000"),
        (lambda: record(HIT, good, uneven), "even step"),
        (lambda: record(HIT[50:], good[50:], TIME[50:]), "whole pulse"),
        (lambda: record(HIT[:55], good[:55], TIME[:55]), "whole pulse"),
        (lambda: record(HIT[:80], good[:80], TIME[:80]), "after the pulse"),
        (lambda: record(HIT[::8], good[::8], TIME[::8]), "at least 5"),
        (lambda: record(HIT, good, 100.0 * TIME), "a pulse of 0.09 s"),
        (lambda: record(HIT, good, duration=5.0), "duration"),
        (
            lambda: hammer_record(
                Signal(TIME, HIT, "force", "N"), Signal(TIME + 1.0, good, "acceleration", "m/s^2")
            ),
            "the same for both",
        ),
    ):
        with pytest.raises(InputError, match=words) as caught:
            call()
        assert len(str(caught.value).splitlines()) == 1


def test_bad_numbers_are_refused(frames) -> None:
    good = record(HIT, linear(frames["in_plane"], "in_plane"))
    slow = dataclasses.replace(good, step=2e-3)
    for call, words in (
        (lambda: fit_frame([], racket(), "in_plane"), "records"),
        (lambda: fit_frame([good], racket(), "sideways"), "in_plane, out_of_plane"),
        (lambda: fit_frame([good], racket(), "in_plane", 0.5), "on the handle"),
        (lambda: fit_frame([good], racket(), "in_plane", np.nan), "on the handle"),
        (lambda: fit_frame([good], racket(), "in_plane", drake_passes=-1), "drake_passes"),
        (lambda: fit_frame([slow], racket(), "in_plane"), "sample rate"),
        (lambda: fit_frame([good], racket(), "in_plane", node()), "node"),
    ):
        with pytest.raises(InputError, match=words):
            call()


def node() -> float:
    return hammered_frame(racket(), "in_plane", 0.1).node


ROWS = [f"{t:.9g},{f:.9g}" for t, f in zip(TIME, HIT, strict=True)]
BAD = {
    "unit": ("time [s],force [N],acceleration [g]", "a column acceleration"),
    "missing": ("time [s],force [N],other", "a column acceleration"),
    "volts": ("time [s],force [V],acceleration [m/s^2]", "a column force"),
}


@pytest.mark.parametrize("case", list(BAD))
def test_bad_files_are_refused(tmp_path, case) -> None:
    header, words = BAD[case]
    path = tmp_path / "strike.csv"
    path.write_text("\n".join([header, *(f"{row},0" for row in ROWS)]) + "\n")
    with pytest.raises(InputError, match=words):
        read_hammer_record(path)


@pytest.mark.parametrize("samples", [5, 6, 20, 41])
def test_a_pulse_is_widened_by_half_its_length_on_either_side(samples) -> None:
    """Up to where it is 5 % of its peak; the force is zero from there on."""
    force = 5.0 * np.ones(len(TIME)) * (np.arange(len(TIME)) % 2)  # of 500 N: below 5 %
    force[60 : 60 + samples] = 500.0
    found = record(force, force + 1.0, duration=0.03)
    foot = -(-samples // 2)
    assert found.start == pytest.approx(TIME[60 - foot])
    assert found.after == samples + 2 * foot
    assert found.pulse == pytest.approx((samples - 1) * STEP)
    np.testing.assert_array_equal(found.force[: found.after], force[60 - foot :][: found.after])
    assert not found.force[found.after :].any()
    assert len(found.force) == 601
    ringing = found.ringing()
    np.testing.assert_array_equal(ringing.value, found.acceleration[found.after :])
    assert ringing.time[0] == pytest.approx((samples + 2 * foot) * STEP)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"samples": 4}, "4 samples in the pulse"),
        ({"samples": 5}, ""),
        ({"peak": 5000.0}, ""),
        ({"peak": 5001.0}, "5000"),
        ({"end": 60 + 20 + 10 + 40}, ""),
        ({"end": 60 + 20 + 10 + 39}, "39 samples after"),
        ({"jitter": 0.0499}, ""),
        ({"jitter": 0.0502}, "off an even step"),
        ({"duration": 0.0049}, "duration"),
        ({"duration": 0.005}, ""),
        ({"duration": 1.0}, ""),
        ({"duration": 1.001}, "duration"),
        ({"long": 0.0499}, ""),
        ({"long": 0.0501}, "a pulse of"),
    ],
)
def test_records_are_taken_up_to_their_borders(change, words) -> None:
    samples, end = change.get("samples", 20), change.get("end", len(TIME))
    time = TIME[0] + np.arange(len(TIME)) * STEP
    force = np.zeros(len(TIME))
    force[60 : 60 + samples] = change.get("peak", 500.0)
    if "long" in change:
        time = TIME[0] + np.arange(len(TIME)) * change["long"] / (samples - 1)
    time[500] += change.get("jitter", 0.0) * STEP
    duration = change.get("duration", 0.03 if "long" not in change else 1.0)
    with pytest.raises(InputError, match=words) if words else nullcontext():
        record(force[:end], force[:end] + 1.0, time[:end], duration=duration)


def test_a_file_is_read_and_cut(frames, tmp_path) -> None:
    """Times rounded to a microsecond are an even grid."""
    good = linear(frames["in_plane"], "in_plane")
    rows = [f"{t:.6f},{a:.12g},{f:.12g}" for t, f, a in zip(TIME, HIT, good, strict=True)]
    path = tmp_path / "strike.csv"
    path.write_text("\n".join(["time [s],acceleration [m/s^2],force [N]", *rows]) + "\n")
    found = read_hammer_record(path, duration=0.03)
    assert found.step == pytest.approx(STEP, rel=1e-9)
    assert len(found.time) == 601
    assert found.start < 0.0
    assert found.force[found.after :].max() == 0.0
    assert found.force.max() == pytest.approx(500.0)


# what is shown


def test_dataset_and_figure_show_the_fit(frames) -> None:
    plain = linear(frames["in_plane"], "in_plane")
    short = record(HIT, plain, duration=0.03)
    fitted = fit_frame([noisy(plain, 0), short], racket(), "in_plane", PLACE, drake_passes=0)
    data = fitted.to_dataset()
    for variable in data.variables.values():
        assert variable.attrs["units"]
        assert variable.attrs["long_name"]
    left = (data["model"] - data["acceleration"]).where(data["time"] >= data["fitted_from"] - 1e-9)
    assert float(np.sqrt((left**2).mean())) == pytest.approx(fitted.rms, rel=1e-9)
    assert data.attrs["kf [N*m/rad]"] == fitted.kf.value
    figure = frame_fit_figure({"in_plane": data}, "a racket")
    measured, model = figure.axes[2].get_lines()[:2]
    shown = measured.get_xdata()
    assert shown[0] == pytest.approx(1e3 * float(data["fitted_from"][0]))
    assert len(model.get_xdata()) == len(shown)
    assert "N m s/rad" in figure.axes[2].get_title()
    first = data.isel(strike=0)
    remains, zero = figure.axes[3].get_lines()
    np.testing.assert_array_equal(
        remains.get_ydata(), (first["model"] - first["acceleration"])[-len(shown) :]
    )
    assert list(zero.get_ydata()) == [0.0, 0.0]
    share = 100.0 * fitted.relative_rms
    assert (
        figure.axes[3].get_title() == f"RMS {fitted.rms:.3g} m/s², {share:.2g} % of the ringing's"
    )
    hit = figure.axes[0].get_lines()[0]
    assert hit.get_xdata()[-1] == pytest.approx(1.5 * shown[0], abs=1e3 * STEP)
    assert max(hit.get_ydata()) == float(first["force"].max())
    assert figure.axes[0].get_title() == "in plane, 60 mm from the butt"
