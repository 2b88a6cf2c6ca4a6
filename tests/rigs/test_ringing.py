"""Readings of decays that are known in closed form, at few and at many samples a period."""

from __future__ import annotations

import numpy as np
import pytest

from drake_racket.io.errors import InputError
from drake_racket.io.signals import Signal
from drake_racket.rigs.hammer.ringing import analyse_ringing

FREQUENCY, RATIO, SIZE = 120.0, 0.02, 3.0


def decay(rate, *, ratio=RATIO, periods=12.0, drift=(0.4, -0.3), phase=0.7, noise=0.0):
    """Offset and drift (over the whole record), and A exp(-s t) cos(w t + a)."""
    time = 0.1 + np.arange(round(periods / FREQUENCY * rate)) / rate
    t = time - time[0]
    slow = 2.0 * np.pi * FREQUENCY * ratio / np.sqrt(1.0 - ratio**2)
    wave = SIZE * np.exp(-slow * t) * np.cos(2.0 * np.pi * FREQUENCY * t + phase)
    value = wave + drift[0] + drift[1] * t / t[-1]
    value += noise * np.random.default_rng(1).standard_normal(len(t))
    return Signal(time, value, "angle", "rad")


@pytest.mark.parametrize(("per_period", "rel"), [(8.9, 6e-5), (15.3, 6e-5), (60.0, 1e-9)])
@pytest.mark.parametrize("ratio", [0.005, 0.02, 0.06])
def test_all_three_readings_are_the_decays(per_period, rel, ratio):
    found = analyse_ringing(decay(per_period * FREQUENCY, ratio=ratio))
    assert found.fit_frequency == pytest.approx(FREQUENCY, rel=1e-9)
    assert found.fit_damping_ratio == pytest.approx(ratio, rel=1e-7)
    assert found.amplitude == pytest.approx(SIZE, rel=1e-9)
    assert found.residual < 1e-9
    assert found.frequency == pytest.approx(FREQUENCY, rel=rel)
    decrement = 2.0 * np.pi * ratio / np.sqrt(1.0 - ratio**2)
    assert found.logarithmic_decrement == pytest.approx(decrement, rel=10.0 * rel)
    whole = np.hypot(2.0 * np.pi, found.logarithmic_decrement)
    assert found.damping_ratio == pytest.approx(found.logarithmic_decrement / whole, rel=1e-12)
    assert found.spectrum_frequency == pytest.approx(FREQUENCY, rel=1e-5)
    assert found.lines[np.argmax(found.spectrum[1:]) + 1] == pytest.approx(FREQUENCY, rel=0.01)


def test_a_steady_sine_has_its_amplitude_in_the_spectrum():
    found = analyse_ringing(decay(40.0 * FREQUENCY, ratio=1e-6, drift=(0.0, 0.0), phase=0.0))
    assert max(found.spectrum) == pytest.approx(SIZE, rel=1e-3)


def test_what_is_before_the_start_is_not_read():
    signal = decay(30.0 * FREQUENCY)
    value = signal.value.copy()
    value[:40] += 20.0
    start = float(signal.time[40])
    found = analyse_ringing(Signal(signal.time, value, "angle", "rad"), start=start)
    assert found.fit_frequency == pytest.approx(FREQUENCY, rel=1e-9)
    slow = 2.0 * np.pi * FREQUENCY * RATIO
    assert found.amplitude == pytest.approx(SIZE * np.exp(-slow * (start - 0.1)), rel=1e-3)


def test_times_rounded_in_a_file_are_even_and_others_are_made_so():
    signal = decay(30.0 * FREQUENCY)
    step = signal.time[1] - signal.time[0]
    sway = np.where(np.arange(len(signal.time)) % 2, 0.08, -0.08) * step
    sway[[0, -1]] = 0.0
    rounded = analyse_ringing(Signal(signal.time + sway, signal.value, "angle", "rad"))
    assert rounded.residual < 1e-9  # the samples stand as they are
    time = signal.time + 2.0 * sway
    t = time - time[0]
    slow = 2.0 * np.pi * FREQUENCY * RATIO / np.sqrt(1.0 - RATIO**2)
    wave = SIZE * np.exp(-slow * t) * np.cos(2.0 * np.pi * FREQUENCY * t + 0.7)
    moved = analyse_ringing(Signal(time, wave, "angle", "rad"))
    assert 1e-6 < moved.residual < 0.03
    assert moved.fit_frequency == pytest.approx(FREQUENCY, rel=1e-3)


def test_extrema_within_the_noise_are_left_out():
    found = analyse_ringing(decay(40.0 * FREQUENCY, periods=30.0, ratio=0.03, noise=0.03))
    assert found.logarithmic_decrement == pytest.approx(2.0 * np.pi * 0.03, rel=0.05)
    assert found.frequency == pytest.approx(FREQUENCY, rel=2e-3)
    assert found.residual == pytest.approx(0.03 / np.sqrt(np.mean(wave_of(0.03) ** 2)), rel=0.1)


def wave_of(ratio):
    return decay(40.0 * FREQUENCY, periods=30.0, ratio=ratio, drift=(0.0, 0.0)).value


@pytest.mark.parametrize(
    ("signal", "told"),
    [
        (decay(7.9 * FREQUENCY), "7.9 samples per period"),
        (decay(8.2 * FREQUENCY), ""),
        (decay(40.0 * FREQUENCY, periods=0.47), "got '19 samples'; allowed: at least 20"),
        (Signal(np.arange(50.0), np.full(50, 2.0), "angle", "rad"), "no oscillation"),
        (Signal(np.arange(50.0), 1.0 + 0.1 * np.arange(50.0), "angle", "rad"), "no oscillation"),
        (decay(40.0 * FREQUENCY, ratio=0.5, periods=8.0), "extrema above noise"),
    ],
)
def test_what_is_no_decay_is_refused(signal, told):
    if not told:
        assert analyse_ringing(signal).fit_frequency == pytest.approx(FREQUENCY, rel=1e-9)
        return
    with pytest.raises(InputError, match=told):
        analyse_ringing(signal)


def test_noise_alone_is_refused():
    value = np.random.default_rng(3).standard_normal(400)
    with pytest.raises(InputError, match=r"at most 80 %"):
        analyse_ringing(
            Signal(np.arange(400) * 1e-3, np.convolve(value, np.ones(9), "same"), "a", "1")
        )
