"""Stiffness and damping of the frame's joint in one plane, from strikes with the impact hammer.

The linear two-body racket (`hammer_model`) is fitted to the ringing (`ringing_problem`), with exact
derivatives. Drake's racket departs from it, with the cube of the hit: by 2e-5 of the ringing at
100 N and 2e-3 at 1 kN. So the difference between the two, computed with Drake at the fitted
values, is added to the linear model and the fit repeated: Gauss-Newton on Drake's residuals with
the linear model's derivatives. What it moved is kept.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from drake_racket.identify.core.estimate import Estimate
from drake_racket.identify.core.least_squares import fit
from drake_racket.identify.core.result import FitResult
from drake_racket.identify.frame.checks import frame_warnings
from drake_racket.identify.frame.drake_difference import DrakeDifference, check_rates
from drake_racket.identify.frame.hammer_model import HammeredFrame, hammered_frame
from drake_racket.identify.frame.hammer_record import (
    HammerRecord,
    hammer_record,
    read_hammer_record,
)
from drake_racket.identify.frame.ringing_problem import RingingProblem
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Progress, Report
from drake_racket.io.units import labelled
from drake_racket.parameters.racket import RacketParameters
from drake_racket.rigs.hammer.impact_hammer import DIRECTIONS
from drake_racket.rigs.hammer.ringing import analyse_ringing

if TYPE_CHECKING:
    import xarray

__all__ = ["FrameFit", "HammerRecord", "fit_frame", "hammer_record", "read_hammer_record"]

Array = NDArray[np.float64]

BLIND_STARTS = 16  # of kf, 9 times as high as low: 100 ms tell some 12 frequencies in it apart
SETTLED = 1e-6  # relative change of kf and cf below which the passes through Drake end


@dataclass(frozen=True)
class FrameFit:
    """Holds kf and cf in one plane.

    Attributes:
        direction: `in_plane` or `out_of_plane`.  place: m from the butt.
        records: the strikes.
        result: of kf, cf and each strike's gain and delay; its rms is of the ringing after the
            pulse, m/s^2.
        frame: what the racket's masses say.
        passes: (k, 2) kf and cf of the linear fit and after each pass through Drake.
        models: acceleration over each record, m/s^2, fitted, with gain and delay in the ringing.
        record_rms: m/s^2 over the whole records, the force as measured (gain 1, no delay): the
            paper's measure.
        reading: of the racket's joint labels.
        warnings: one line each.

    """

    direction: str
    place: float
    records: tuple[HammerRecord, ...]
    result: FitResult
    frame: HammeredFrame
    passes: Array
    models: tuple[Array, ...]
    record_rms: float
    reading: str
    warnings: tuple[str, ...]

    @property
    def kf(self) -> Estimate:
        """Gives the joint's stiffness, N m/rad."""
        return self._estimate(0, "N*m/rad")

    @property
    def cf(self) -> Estimate:
        """Gives the joint's damping, N m s/rad."""
        return self._estimate(1, "N*m*s/rad")

    @property
    def rms(self) -> float:
        """Gives the root mean square in m/s^2, of the ringing after the pulse."""
        return self.result.rms

    @property
    def relative_rms(self) -> float:
        """Gives the RMS over the measured ringing's own root mean square."""
        ringing = np.concatenate([r.acceleration[r.after :] for r in self.records])
        return self.rms / float(np.sqrt(np.mean(ringing**2)))

    @property
    def frequency(self) -> Estimate:
        """Gives the undamped frequency, Hz; the masses are taken as exact."""
        f = math.sqrt(self.kf.value / self.frame.inertia) / (2.0 * math.pi)
        low, high = (f * (1.0 + 0.5 * (b / self.kf.value - 1.0)) for b in self.kf.interval)
        return Estimate(f, 0.5 * f * self.kf.standard_error / self.kf.value, (low, high), "Hz")

    @property
    def damping_ratio(self) -> float:
        """Gives the mode's damping ratio, cf / (2 sqrt(kf J))."""
        return self.cf.value / (2.0 * math.sqrt(self.kf.value * self.frame.inertia))

    def fields(self) -> dict[str, Estimate]:
        """Gives both under their names in a racket file's `throat_joint`, by its `reading`."""
        about_z = self.direction == "in_plane"
        label = "in" if about_z == (self.reading == "as_printed") else "out"
        return {f"stiffness_{label}": self.kf, f"damping_{label}": self.cf}

    def to_dataset(self) -> xarray.Dataset:
        """Labels force, acceleration and model of each strike over time; estimates are attrs.

        Strikes shorter than the longest end in NaN.
        """
        import xarray as xr

        longest = max(self.records, key=lambda r: len(r.force))
        count, strikes = len(longest.force), range(1, len(self.records) + 1)

        def table(columns: Sequence[Array]) -> Array:
            return np.stack([np.append(c, np.full(count - len(c), np.nan)) for c in columns])

        columns = (
            ("force", "N", "force of the hammer", [r.force for r in self.records]),
            (
                "acceleration",
                "m/s^2",
                "acceleration measured",
                [r.acceleration for r in self.records],
            ),
            ("model", "m/s^2", "acceleration of the fitted model", self.models),
        )
        ends = [r.after * r.step for r in self.records]
        gains, delays = self.result.estimates[2::2], self.result.estimates[3::2]
        data = {
            name: labelled(("strike", "time"), table(values), units, text)
            for name, units, text, values in columns
        } | {
            name: labelled("strike", values, units, text)
            for name, units, text, values in (
                ("fitted_from", "s", "end of the pulse, from where it is fitted", ends),
                ("gain", "1", "measured over modelled ringing", gains),
                ("delay", "s", "of the measured ringing after the modelled", delays),
            )
        }
        text = {"units": "s", "long_name": "time from the pulse's foot"}
        number = {"units": "1", "long_name": "number of the strike"}
        attributes = {
            "title": f"hammer, {self.direction.replace('_', ' ')}, fitted",
            "direction": self.direction,
            "place_m": self.place,
            "participation": self.frame.participation,
            "rms_m_per_s2": self.rms,
            "relative_rms": self.relative_rms,
            "record_rms_m_per_s2": self.record_rms,
            "warnings": "\n".join(self.warnings),
        }
        for name, estimate in (("kf", self.kf), ("cf", self.cf), ("frequency", self.frequency)):
            attributes[f"{name} [{estimate.unit}]"] = estimate.value
            attributes[f"{name}_standard_error [{estimate.unit}]"] = estimate.standard_error
        return xr.Dataset(
            data,
            coords={"time": ("time", longest.time, text), "strike": ("strike", strikes, number)},
            attrs=attributes,
        )

    def _estimate(self, i: int, unit: str) -> Estimate:
        low, high = (float(x) for x in self.result.confidence_intervals[i])
        error = float(self.result.standard_errors[i])
        return Estimate(float(self.result.estimates[i]), error, (low, high), unit)


def fit_frame(
    records: Sequence[HammerRecord],
    racket: RacketParameters,
    direction: str,
    place: float | None = None,
    *,
    drake_passes: int = 2,
    starts: int = 1,
    seed: int = 0,
    progress: Report | None = None,
) -> FrameFit:
    """Fits kf and cf to strikes at one place in one direction.

    Args:
        racket: whose frame's masses, lengths and inertias are taken; its kf and cf matter only as
            a first guess where the ringing cannot be read by itself.
        direction: `in_plane` or `out_of_plane`.
        place: of hammer and accelerometer, m from the butt; the racket's `accelerometer` landmark
            if None.
        drake_passes: at most, through Drake (about a second per strike and pass); 0: linear only.
        starts, seed: of the search (`least_squares.fit`). The first guess is the frequency read
            from the ringing: one start finds the minimum (tests).
        progress: called with the passes done; `rms` (m/s^2) so far.

    Raises:
        InputError: no record, a number out of range, or a sample rate that Drake's rig does not
            take.

    """
    if not records:
        raise InputError("records", 0, "one or more strikes")
    if direction not in DIRECTIONS:
        raise InputError("direction", direction, ", ".join(DIRECTIONS))
    length = racket.handle.length.value
    place = racket.landmarks.accelerometer.value if place is None else place
    if not 0.0 <= place <= length:
        raise InputError("place", place, f"0 to {length} m from the butt, on the handle")
    if not 0 <= drake_passes <= 10:
        raise InputError("drake_passes", drake_passes, "0 to 10")
    if drake_passes:
        check_rates(records)
    frame = hammered_frame(racket, direction, place)
    if abs(frame.participation) < 1e-6:
        raise InputError("place", place, f"away from the mode's node at {frame.node:.4g} m")
    guess, notes = _first_guess(records, frame, racket, direction)
    title = f"kf and cf, {direction.replace('_', ' ')}"
    problem = RingingProblem(records, frame, guess, title=title)
    if notes:  # the frequency is not known: the misfit has a minimum for every beat
        starts = max(starts, BLIND_STARTS)
    result = fit(problem, starts=starts, seed=seed)
    passes = [result.estimates[:2]]
    drake = DrakeDifference(racket, direction, place)
    for done in range(drake_passes):
        if progress is not None:
            progress(Progress("fitting", done + 1, drake_passes + 1, rms=result.rms))
        corrections = [
            drake.acceleration(record, frame, *result.estimates[[0, 1, 2 + 2 * i]].tolist())
            for i, record in enumerate(records)
        ]
        start = float(result.estimates[0]), float(result.estimates[1])
        problem = RingingProblem(records, frame, start, corrections=corrections, title=title)
        result = fit(problem, starts=1)
        passes.append(result.estimates[:2])
        if np.abs(passes[-1] / passes[-2] - 1.0).max() < SETTLED:
            break
    if progress is not None:
        progress(Progress("fitting", drake_passes + 1, drake_passes + 1, rms=result.rms))
    warnings = [*notes, *result.warnings]
    warnings += frame_warnings(records, frame, place, result, np.array(passes), drake_passes > 0)
    models = _models(problem, result.estimates)
    return FrameFit(
        direction=direction,
        place=place,
        records=tuple(records),
        result=result,
        frame=frame,
        passes=np.array(passes),
        models=models,
        record_rms=_record_rms(problem, result.estimates),
        reading=racket.throat_joint.reading.value,
        warnings=tuple(warnings),
    )


def _first_guess(
    records: Sequence[HammerRecord],
    frame: HammeredFrame,
    racket: RacketParameters,
    direction: str,
) -> tuple[tuple[float, float], list[str]]:
    """Of kf and cf: from the first strike whose ringing can be read, or the racket's own."""
    reason = ""
    for record in records:
        try:
            found = analyse_ringing(record.ringing())
        except InputError as error:
            reason = reason or str(error)
            continue
        ratio = min(max(found.fit_damping_ratio, 1e-4), 0.4)
        w = 2.0 * math.pi * found.fit_frequency / math.sqrt(1.0 - ratio * ratio)
        return (frame.inertia * w * w, 2.0 * ratio * frame.inertia * w), []
    stiffness, damping = getattr(racket.throat_joint, direction)()
    return (stiffness, damping), [f"first guess: the racket's own kf and cf, since {reason}"]


def _models(problem: RingingProblem, x: Array) -> tuple[Array, ...]:
    """The acceleration over each record, its ringing with gain and delay."""
    found = []
    for i, record in enumerate(problem.records):
        gain, delay = x[2 + 2 * i : 4 + 2 * i]
        joint = {"stiffness": x[0], "damping": x[1]}
        whole = gain * problem.frame.acceleration(record.force, record.step, **joint)
        late, _ = problem.frame.bending(record.force, record.step, **joint, delay=delay)
        whole[record.after :] = gain * late[record.after :]
        found.append(whole + problem.corrections[i])
    return tuple(found)


def _record_rms(problem: RingingProblem, x: Array) -> float:
    """Over the whole records, the force as measured."""
    plain = x.copy()
    plain[2::2], plain[3::2] = 1.0, 0.0
    left = [
        model - record.acceleration
        for model, record in zip(_models(problem, plain), problem.records, strict=True)
    ]
    return float(np.sqrt(np.mean(np.concatenate(left) ** 2)))
