"""Checks what a fit of the frame should make one doubt."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drake_racket.identify.core.result import FitResult
from drake_racket.identify.frame.hammer_model import HammeredFrame
from drake_racket.identify.frame.hammer_record import HammerRecord

LITTLE = 0.2  # of the butt's motion in the mode
MOST_GAIN_ERROR = 0.05
MOST_LEFT = 0.1  # of the ringing's root mean square


def frame_warnings(
    records: Sequence[HammerRecord],
    frame: HammeredFrame,
    place: float,
    result: FitResult,
    passes: NDArray[np.float64],
    through_drake: bool,
) -> list[str]:
    """Lists what to doubt in a fit of the frame, one line each.

    Args:
        passes: (k, 2) kf and cf of the linear fit and after each pass through Drake.

    """
    found = []
    share = abs(frame.participation)
    if share < LITTLE:
        found.append(
            f"place {place:.4g} m, {abs(frame.node - place):.2g} m from the mode's node: it moves "
            f"{100.0 * share:.2g} % as far as the butt and rings, hit there too, with "
            f"{100.0 * share**2:.2g} % of the butt's ringing"
        )
    left = result.residuals
    ringing = [r.acceleration[r.after :] for r in records]
    size = float(np.sqrt(np.mean(np.concatenate(ringing) ** 2)))
    if result.rms > MOST_LEFT * size:
        found.append(
            f"RMS of the residual {result.rms:.3g} m/s^2 is {100.0 * result.rms / size:.2g} % of "
            f"the ringing's ({size:.3g} m/s^2)"
        )
    correlation = float(left[1:] @ left[:-1] / max(float(left @ left), np.finfo(float).tiny))
    if correlation > 0.3 and result.rms > 1e-3 * size:
        found.append(
            f"neighbouring residuals are alike (correlation {correlation:.2f}): more than one "
            "mode, drift or filter; intervals, which take noise, are too narrow"
        )
    for i, record in enumerate(records):
        gain, delay = result.estimates[2 + 2 * i : 4 + 2 * i]
        gain_error, delay_error = 3.0 * result.standard_errors[2 + 2 * i : 4 + 2 * i]
        if abs(gain - 1.0) > max(MOST_GAIN_ERROR, gain_error):
            found.append(
                f"{record.where}: rings {gain:.3g} times as strongly as the racket's masses and "
                "the force say: calibration, place or inertia is off"
            )
        if abs(delay) > max(record.step, delay_error):
            found.append(
                f"{record.where}: rings {1e6 * delay:.3g} us after the force says, more than one "
                "sample: channels are not in step, or filtered"
            )
        if abs(record.offset) > 0.02 * size:
            found.append(
                f"{record.where}: {record.offset:+.3g} m/s^2 before the pulse: take the offset away"
            )
    if through_drake and len(passes) > 1:
        last = np.abs(passes[-1] / passes[-2] - 1.0)
        if last[0] > 1e-3 or last[1] > 1e-2:
            found.append(
                f"the last pass through Drake moved kf by {100.0 * last[0]:.2g} % and cf by "
                f"{100.0 * last[1]:.2g} %: take more passes"
            )
    return found
