"""Signals: what is written is read back, and whatever is wrong with a CSV is one line of error."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drake_racket.io.errors import InputError
from drake_racket.io.signals import MAX_BYTES, Signal, pulse_extent, read_signal
from drake_racket.rigs.hammer.ringing import analyse_ringing
from tests.conftest import write_signal

SETTINGS = settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
NUMBERS = st.floats(-1e12, 1e12, allow_nan=False)


def good(count: int = 30) -> list[str]:
    return ["time [s],force [N]", *(f"{0.001 * i:.3f},{np.sin(0.1 * i):.6f}" for i in range(count))]


def refused(path: Path, **options: float) -> str:
    with pytest.raises(InputError) as caught:
        read_signal(path, "force", "N", **options)
    message = str(caught.value)
    assert len(message.splitlines()) == 1
    assert message.isprintable()
    assert len(message) < 1500
    return message


@SETTINGS
@given(
    start=NUMBERS,
    steps=st.lists(st.floats(1e-6, 1e3), min_size=19, max_size=60),
    data=st.data(),
)
def test_a_written_signal_is_read_back_to_the_last_bit(tmp_path, start, steps, data) -> None:
    time = np.concatenate([[start], start + np.cumsum(steps)])
    if not (np.diff(time) > 0.0).all():
        return
    value = data.draw(st.lists(NUMBERS, min_size=len(time), max_size=len(time)))
    signal = Signal(time, np.array(value), "force", "N")
    write_signal(signal, tmp_path / "s.csv")
    back = read_signal(tmp_path / "s.csv", "force", "N")
    np.testing.assert_array_equal(back.time, signal.time)
    np.testing.assert_array_equal(back.value, signal.value)


def test_other_columns_blank_lines_and_a_byte_order_mark_are_passed_over(tmp_path) -> None:
    rows = [f"{0.1 * i:g}, note {i} , {i * i}" for i in range(25)]
    text = "\ufefftime [s], remark ,force [N]\r\n" + "\r\n\r\n".join(rows) + "\r\n\r\n"
    (tmp_path / "s.csv").write_bytes(text.encode())
    signal = read_signal(tmp_path / "s.csv", "force", "N")
    np.testing.assert_allclose(signal.value, np.arange(25.0) ** 2)
    np.testing.assert_allclose(signal.time, 0.1 * np.arange(25))


BROKEN = {
    "no such column": (["time [s],load [N]", *good()[1:]], ["'time [s], load [N]'", "force [N]"]),
    "another unit": (["time [s],force [V]", *good()[1:]], ["'force [V]'", "force [N]", "kN"]),
    "time in min": (["time [min],force [N]", *good()[1:]], ["'time [min]'", "time [s]", "ms"]),
    "no unit": (["time [s],Force", *good()[1:]], ["'Force'", "force [N]"]),
    "no header": (good()[1:], ["time [s]"]),
    "column twice": (
        ["time [s],force [N],force [N]", *(f"{r},1" for r in good()[1:])],
        ["twice"],
    ),
    "words": ([*good()[:4], "0.0035,low", *good()[5:]], ["row 5", "'low'", "force [N]"]),
    "empty cell": ([*good()[:4], "0.0035,", *good()[5:]], ["row 5", "''"]),
    "nan": ([*good()[:4], "0.0035,nan", *good()[5:]], ["row 5", "'nan'"]),
    "infinite time": ([*good(), "inf,0"], ["row 32", "'inf'"]),
    "overflow": ([*good(), "1,1e999"], ["row 32", "1e999"]),
    "underscore": ([*good(), "1,1_000"], ["row 32", "1_000"]),
    "a cell too few": ([*good(), "1"], ["row 32", "1 cells", "2 cells"]),
    "a cell too many": ([*good(), "1,2,3"], ["row 32", "3 cells"]),
    "repeated time": ([*good(), good()[-1]], ["0.029 after 0.029", "sample 31"]),
    "unsorted time": ([good()[0], *good()[:0:-1]], ["increase"]),
    "few samples": (good(19), ["19 samples", "at least 20"]),
    "header only": (good(0), ["no rows"]),
    "blank lines": (["", "  ", ",,"], ["empty"]),
    "open quote": ([*good(), '1,"2'], ["CSV"]),
}


@pytest.mark.parametrize("case", list(BROKEN))
def test_what_is_wrong_is_named(tmp_path, case) -> None:
    rows, words = BROKEN[case]
    (tmp_path / "s.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    message = refused(tmp_path / "s.csv")
    assert all(word in message for word in words), message


def test_files_that_cannot_be_read(tmp_path) -> None:
    assert "No such file" in refused(tmp_path / "none.csv")
    assert "directory" in refused(tmp_path)
    refused(tmp_path / "a\0b.csv")
    (tmp_path / "empty.csv").touch()
    assert "empty" in refused(tmp_path / "empty.csv")
    (tmp_path / "latin.csv").write_bytes("time [s],force [N]\n0,1 µ\n".encode("latin-1"))
    assert "row 2" in refused(tmp_path / "latin.csv")
    with (tmp_path / "large.csv").open("wb") as file:
        file.truncate(MAX_BYTES + 1)
    assert str(MAX_BYTES) in refused(tmp_path / "large.csv")


def test_samples_too_far_apart(tmp_path) -> None:
    rows = good()
    del rows[10]  # a gap of 2 ms
    (tmp_path / "s.csv").write_text("\n".join(rows))
    message = refused(tmp_path / "s.csv", longest_step=1e-3)
    assert "0.002 s" in message
    assert "0.001 s" in message
    assert len(read_signal(tmp_path / "s.csv", "force", "N", longest_step=2e-3).time) == 29


@SETTINGS
@given(data=st.data())
def test_any_damage_to_a_file_is_one_line_or_harmless(tmp_path, data) -> None:
    content = bytearray("\n".join(good()).encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content) - 1))
        end = data.draw(st.integers(at, min(at + 40, len(content))))
        content[at:end] = data.draw(st.binary(max_size=8) | st.text(max_size=6).map(str.encode))
        content = content or bytearray(b" ")
    (tmp_path / "s.csv").write_bytes(bytes(content))
    try:
        signal = read_signal(tmp_path / "s.csv", "force", "N", longest_step=0.01)
    except InputError:
        refused(tmp_path / "s.csv", longest_step=0.01)
        return
    assert np.isfinite(signal.value).all()
    assert len(signal.time) >= 20
    assert 0.0 < np.diff(signal.time).min() <= np.diff(signal.time).max() <= 0.01 * (1 + 1e-6)


@pytest.mark.parametrize(
    ("time", "value"),
    [([0.0, 1.0], [1.0]), ([0.0], [1.0]), ([0.0, np.nan], [0, 0]), ([0, 1], [0, np.inf]),
     ([1.0, 0.0], [0, 0]), ([[0.0, 1.0]], [[0.0, 1.0]])],
)  # fmt: skip
def test_signals_from_python_are_checked(time, value) -> None:
    with pytest.raises(InputError):
        Signal(np.array(time), np.array(value), "force", "N")


def test_a_signal_keeps_its_own_numbers() -> None:
    time = np.arange(3.0)
    signal = Signal(time, time, "force", "N")
    time[0] = -1.0
    assert signal.time[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        signal.value[0] = 1.0


def test_pulse_extent_is_the_stretch_around_the_largest_value() -> None:
    value = np.concatenate([[0.5, 0, 0], np.sin(np.linspace(0.1, 3.0, 40)), [0, 0.4, 0.4, 0]])
    signal = Signal(np.arange(len(value)), value, "force", "N")
    assert pulse_extent(signal, 0.01) == (3, 42)
    with pytest.raises(InputError, match="samples in the pulse"):
        pulse_extent(signal, 0.9)
    with pytest.raises(InputError, match="positive"):
        pulse_extent(Signal(signal.time, -1.0 - value, "force", "N"), 0.01)


# ringing


def decay(frequency: float, ratio: float, time: np.ndarray, phase: float = 0.3) -> np.ndarray:
    """exp(-s t) cos(w_d t + phase) of a mode with undamped frequency (Hz)."""
    w = 2.0 * np.pi * frequency
    return np.exp(-ratio * w * time) * np.cos(w * np.sqrt(1.0 - ratio**2) * time + phase)


@settings(max_examples=25, deadline=None)
@given(
    frequency=st.floats(60.0, 400.0),
    ratio=st.floats(0.002, 0.05),
    phase=st.floats(-3.0, 3.0),
    size=st.sampled_from([1e-3, 1.0, 1e4]),
)
def test_ringing_of_one_mode(frequency, ratio, phase, size) -> None:
    time = 0.5 + np.arange(2000) / 20e3
    value = size * (decay(frequency, ratio, time - 0.5, phase) + 0.2 - (time - 0.5))
    found = analyse_ringing(Signal(time, value, "acceleration", "m/s^2"))
    damped = frequency * np.sqrt(1.0 - ratio**2)
    delta = 2.0 * np.pi * ratio / np.sqrt(1.0 - ratio**2)
    assert found.frequency == pytest.approx(damped, rel=2e-4)
    assert found.logarithmic_decrement == pytest.approx(delta, rel=5e-3)
    assert found.damping_ratio == pytest.approx(ratio, rel=5e-3)
    assert found.fit_frequency == pytest.approx(damped, rel=1e-8)
    assert found.fit_damping_ratio == pytest.approx(ratio, rel=1e-6)
    assert found.amplitude == pytest.approx(size, rel=1e-6)
    assert found.spectrum_frequency == pytest.approx(damped, rel=5e-3)
    assert found.residual < 1e-6


def test_ringing_with_noise_a_higher_mode_and_uneven_steps() -> None:
    generator = np.random.default_rng(3)
    time = np.sort(generator.uniform(0.0, 0.1, 3000))
    value = decay(150.0, 0.02, time) + 0.2 * decay(420.0, 0.02, time)
    value += 0.03 * generator.standard_normal(len(time))
    found = analyse_ringing(Signal(time, value, "acceleration", "m/s^2"))
    assert found.fit_frequency == pytest.approx(150.0, rel=2e-3)
    assert found.frequency == pytest.approx(150.0, rel=5e-3)
    assert found.fit_damping_ratio == pytest.approx(0.02, rel=0.05)
    assert found.damping_ratio == pytest.approx(0.02, rel=0.2)
    assert 0.1 < found.residual < 0.4


@pytest.mark.parametrize("kind", ["zero", "line", "noise", "step", "coarse", "short", "decay"])
def test_what_does_not_ring_is_refused(kind) -> None:
    time = np.arange(2000) / 20e3
    if kind == "coarse":
        time = np.arange(40) / 400.0
    if kind == "short":
        time = time[:15]
    value = {
        "zero": 0.0 * time,
        "line": 3.0 + time,
        "noise": np.random.default_rng(0).standard_normal(len(time)),
        "step": np.sign(time - 0.05),
        "decay": np.exp(-50.0 * time),
    }.get(kind, decay(150.0, 0.02, time))
    with pytest.raises(InputError) as caught:
        analyse_ringing(Signal(time, value, "acceleration", "m/s^2"))
    assert len(str(caught.value).splitlines()) == 1
