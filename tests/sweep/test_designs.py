"""Each design is the one that its name says."""

from __future__ import annotations

import numpy as np
import pytest

from drake_racket import Scenario
from drake_racket.sweep import make_sweep


def points(design: str, seed: int) -> np.ndarray:
    """16 samples of two keys, on the unit square."""
    keys = {
        "speed": {"from": 10.0, "to": 20.0, "unit": "m/s"},
        "racket.string_bed.mass": {"from": 0.01, "to": 0.02, "unit": "kg"},
    }
    axis = {"design": design, "samples": 16, "seed": seed, "keys": keys}
    speed, mass = make_sweep(Scenario(), {"s": axis}).axes[0].columns
    return np.stack(
        [(np.array(speed.values) - 10.0) / 10.0, (np.array(mass.values) - 0.01) / 0.01], 1
    )


def cells(square: np.ndarray, across: int) -> int:
    """How many cells of a grid of 16, `across` wide, hold a sample."""
    where = np.floor(square * [across, 16 // across]).astype(int)
    return len({tuple(cell) for cell in where})


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_sobol_fills_every_cell_and_latin_hypercube_every_row(seed):
    """Sobol's 16 have one in each cell of every grid of 16, a Latin square in rows and columns."""
    assert [cells(points("sobol", seed), across) for across in (1, 2, 4, 8, 16)] == [16] * 5
    latin = points("latin_hypercube", seed)
    assert cells(latin, 1) == cells(latin, 16) == 16
    assert cells(latin, 4) < 16
