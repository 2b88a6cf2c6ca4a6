"""A hammer's record whose pulse does not begin with it is the same pulse, later."""

from __future__ import annotations

import numpy as np
import pytest

from drake_racket import read_signal
from drake_racket.rigs.hammer.force import sampled_pulse


def pulse(folder, begin: float):
    time = np.arange(0.0, 0.02, 5e-5)
    force = np.where(
        (time >= begin) & (time <= begin + 2e-3), 80.0 * np.sin(np.pi * (time - begin) / 2e-3), 0.0
    )
    rows = "".join(f"{t:.6f},{f:.6f}\n" for t, f in zip(time, force, strict=True))
    (folder / "pulse.csv").write_text("time [s],force [N]\n" + rows)
    return sampled_pulse(read_signal(folder / "pulse.csv", "force", "N"))


@pytest.mark.parametrize("begin", [1e-3, 5e-3, 12.5e-3])
def test_start_end_and_impulse(tmp_path, begin):
    found = pulse(tmp_path, begin)
    assert found.start == pytest.approx(begin, abs=5.1e-5)
    assert found.end == pytest.approx(begin + 2e-3, abs=5.1e-5)
    assert found.impulse == pytest.approx(2.0 * 80.0 * 2e-3 / np.pi, rel=2e-3)
    half = len(found.numbers) // 2
    assert found.numbers[0] == found.start
    assert np.interp(begin + 1e-3, found.numbers[:half], found.numbers[half:]) == pytest.approx(
        80.0
    )
    breaks = found.breaks()
    assert (breaks[0], breaks[-1]) == (found.start, found.end)
