"""The force of a hammer over time: a half sine, or straight lines between samples.

    F = P sin(pi t / T),  0 <= t <= T          of the numbers (P, T)
    F = the line through the samples around t  of the numbers (t_1, ..., t_n, F_1, ..., F_n)

and 0 before and after. Each runs on floats, on AutoDiffXd and as machine code.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drake_racket.laws.compilation import compilable


@compilable
def half_sine_force(time: Any, numbers: Any) -> Any:
    """Gives the force (N) of a half sine; `numbers` are its peak (N) and length (s)."""
    if 0.0 <= time <= numbers[1]:
        return numbers[0] * np.sin(math.pi * time / numbers[1])
    return 0.0 * numbers[0]


@compilable
def sampled_force(time: Any, numbers: Any) -> Any:
    """Gives the force (N) on the line through the samples around `time`.

    Args:
        time: s.
        numbers: (2n,) times (s), which rise, then forces (N).

    """
    count = len(numbers) // 2
    if not numbers[0] <= time <= numbers[count - 1]:
        return 0.0 * numbers[count]
    low, high = 0, count - 1
    while high - low > 1:
        middle = (low + high) // 2
        if numbers[middle] <= time:
            low = middle
        else:
            high = middle
    share = (time - numbers[low]) / (numbers[high] - numbers[low])
    return numbers[count + low] + share * (numbers[count + high] - numbers[count + low])
