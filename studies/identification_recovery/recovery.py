"""Whether fits find again the parameters that made their data: errors, and coverage of intervals.

Each repeat makes a laboratory's measurements anew (`laboratory`), fits them and keeps estimates and
95 % intervals. A parameter whose interval is not finite or reaches 0 counts as not determined; its
interval contains the true value, as it should, without saying anything.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drake_racket import BallParameters, Progress, RacketParameters, Report, Signal
from drake_racket.engines import bed_parameters
from drake_racket.identify import (
    AngleTable,
    Estimate,
    RestitutionTable,
    Search,
    StringBedFit,
    determined,
    fit_ball,
    fit_frame,
    fit_friction,
    fit_string_bed,
    hammer_record,
)
from studies.synthetic_laboratory.laboratory import Noise, oblique_table, restitution_table
from studies.synthetic_laboratory.records import hammer_strikes, plate_impacts

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class Trial:
    """One repeat: what was found.

    Attributes:
        found: estimates by name.
        rms: of the fit.  noise: root mean square of the noise put on the measured values.

    """

    found: Mapping[str, Estimate]
    rms: float
    noise: float


def repeat(
    trial: Callable[[np.random.Generator], Trial],
    truth: Mapping[str, float],
    repeats: int,
    *,
    seed: int = 0,
    title: str = "",
    rms_unit: str = "1",
    progress: Report | None = None,
) -> xarray.Dataset:
    """Trials with independent noise.

    Args:
        trial: makes measurements with this generator and fits them.
        truth: true values by name.
        progress: called with the trials done.

    Returns:
        A Dataset over `repeat` and `parameter`: `estimate`, `lower`, `upper`, `standard_error`,
        `determined`, the `rms` and `noise` of each repeat, and the `true_value`.

    """
    import xarray as xr

    trials = []
    for child in np.random.SeedSequence(seed).spawn(repeats):
        trials.append(trial(np.random.default_rng(child)))
        if progress is not None:
            progress(Progress("trials", len(trials), repeats))
    names = list(truth)
    units = [trials[0].found[n].unit for n in names]

    def table(read: Callable[[Estimate], Any]) -> Any:
        return np.array([[read(t.found[n]) for n in names] for t in trials])

    both, unit = ("repeat", "parameter"), "parameter_unit"
    data = {
        "estimate": (both, table(lambda e: e.value), unit, "estimate"),
        "standard_error": (both, table(lambda e: e.standard_error), unit, "standard error"),
        "lower": (both, table(lambda e: e.interval[0]), unit, "lower end of the 95 % interval"),
        "upper": (both, table(lambda e: e.interval[1]), unit, "upper end of the 95 % interval"),
        "determined": (both, table(determined), "1", "interval finite and above 0"),
        "rms": ("repeat", [t.rms for t in trials], rms_unit, "RMS difference of the fit"),
        "noise": ("repeat", [t.noise for t in trials], rms_unit, "RMS of the noise"),
        "true_value": ("parameter", [truth[n] for n in names], unit, "true value"),
    }
    coordinates = {
        "parameter": ("parameter", names, "", "parameter"),
        "parameter_unit": ("parameter", units, "", "unit"),
        "repeat": ("repeat", np.arange(1, repeats + 1), "1", "repeat"),
    }
    return xr.Dataset(
        {n: (d, v, {"units": u, "long_name": t}) for n, (d, v, u, t) in data.items()},
        {n: (d, v, {"units": u, "long_name": t}) for n, (d, v, u, t) in coordinates.items()},
        {"title": title},
    )


def coverage(data: xarray.Dataset) -> NDArray[np.int64]:
    """(parameter,) number of repeats whose interval contains the true value."""
    inside = (data["lower"] <= data["true_value"]) & (data["true_value"] <= data["upper"])
    return np.asarray(inside.sum("repeat").to_numpy())


def recovery_rows(data: xarray.Dataset) -> list[tuple[str, ...]]:
    """Rows for a table: see RECOVERY_HEADER."""
    count, inside = data.sizes["repeat"], coverage(data)
    rows: list[tuple[str, ...]] = []
    for i, name in enumerate(data["parameter"].to_numpy()):
        one = data.isel(parameter=i)
        true = float(one["true_value"])
        estimate, error = one["estimate"].to_numpy(), one["standard_error"].to_numpy()
        finite = error[np.isfinite(error)]
        rows.append(
            (
                str(name),
                f"{true:.5g}",
                str(one["parameter_unit"].item()),
                f"{100.0 * (np.median(estimate) / true - 1.0):+.2g}",
                f"{100.0 * np.std(estimate) / true:.2g}",
                f"{100.0 * np.median(finite) / true:.2g}" if len(finite) else "none",
                f"{inside[i]} of {count}",
                f"{int(one['determined'].sum())} of {count}",
            )
        )
    return rows


RECOVERY_HEADER = (
    "parameter",
    "true",
    "unit",
    "median error (%)",
    "scatter, s.d. (%)",
    "standard error, median (%)",
    "in 95 % interval",
    "determined",
)


def measured_restitution(table: xarray.Dataset) -> RestitutionTable:
    """A laboratory's table as if read from its file."""
    columns = [table[n].to_numpy() for n in ("point", "approach_speed", "restitution")]
    return RestitutionTable(
        points=columns[0].astype(np.int64),
        speeds=columns[1],
        restitution=columns[2],
        sigma=None,
        repeats=np.ones(len(columns[0]), dtype=np.int64),
        where=table.attrs["title"],
        sha256="none",
    )


def measured_angles(table: xarray.Dataset) -> AngleTable:
    """A laboratory's table as if read from its file."""
    names = ("approach_speed", "incidence", "azimuth", "rebound_angle")
    speeds, incidence, azimuth, angle = (table[n].to_numpy() for n in names)
    return AngleTable(
        points=table["point"].to_numpy().astype(np.int64),
        speeds=speeds,
        incidence=incidence,
        azimuth=azimuth,
        angle=angle,
        sigma=None,
        repeats=np.ones(len(speeds), dtype=np.int64),
        where=table.attrs["title"],
        sha256="none",
    )


def string_bed_truth(racket: RacketParameters, free: Sequence[str] | None) -> dict[str, float]:
    """True values of the free parameters."""
    names, values = bed_parameters(racket)
    return {n: float(v) for n, v in zip(names, values, strict=True) if free is None or n in free}


def exact_string_bed(
    racket: RacketParameters, ball: BallParameters, *, seed: int = 0, spread: float = 1.5
) -> StringBedFit:
    """All parameters of a bed from data without noise, begun up to `spread` times off.

    One impact at each point and speed.
    """
    rng = np.random.default_rng(seed)
    made = restitution_table(racket, ball, rng, repeats=1, noise=Noise.none())
    start = {
        n: v * float(spread ** rng.uniform(-1.0, 1.0))
        for n, v in string_bed_truth(racket, None).items()
    }
    table = measured_restitution(made)
    return fit_string_bed(table, racket, ball, start=start, options=Search(starts=1))


def string_bed_trial(
    racket: RacketParameters,
    ball: BallParameters,
    *,
    free: Sequence[str] | None = None,
    noise: Noise | None = None,
    profiles: bool = False,
    **grid: Any,
) -> Callable[[np.random.Generator], Trial]:
    """A trial of restitution, the mean of five shots at nine points and six speeds.

    The fit begins at the true values: it is the minimum beside them whose interval is asked for.

    Args:
        grid: of `laboratory.restitution_table`.

    """

    def trial(rng: np.random.Generator) -> Trial:
        made = restitution_table(racket, ball, rng, noise=noise, **grid)
        shots = measured_restitution(made)
        table = shots.averaged()
        # the noise that the averages carry: the same shots without it, on the same settings
        true = made["true_rebound_speed"].to_numpy() / made["true_approach_speed"].to_numpy()
        own = measured_restitution(made.assign(restitution=("impact", true))).averaged()
        off = float(np.sqrt(np.mean((table.restitution - own.restitution) ** 2)))
        options = Search(starts=1)
        fit = fit_string_bed(table, racket, ball, free=free, options=options, profiles=profiles)
        return Trial(fit.estimates, fit.rms, off)

    return trial


def friction_trial(
    racket: RacketParameters,
    ball: BallParameters,
    *,
    noise: Noise | None = None,
    angle_reading: str = "from_plane",
    reading: str = "velocity",
) -> Callable[[np.random.Generator], Trial]:
    """A trial of rebound angles, the mean of five shots, both strokes at nine points."""

    def trial(rng: np.random.Generator) -> Trial:
        made = oblique_table(
            racket,
            ball,
            rng,
            angle_readings=[angle_reading],
            friction_reading=reading,
            noise=noise,
        )
        table = measured_angles(made).averaged()
        angle = made["true_rebound_angle"].to_numpy()
        own = measured_angles(made.assign(rebound_angle=("impact", angle))).averaged()
        off = float(np.sqrt(np.mean((table.angle - own.angle) ** 2)))
        fit = fit_friction(table, racket, ball, reading=reading, options=Search(starts=1))
        return Trial(fit.estimates, fit.rms, off)

    return trial


def friction_truth(racket: RacketParameters) -> dict[str, float]:
    """True coefficients by name."""
    return {f"mu{i + 1}": v for i, v in enumerate(racket.friction.coefficients.value)}


def ball_trial(
    ball: BallParameters, *, noise: Noise | None = None, repeats: int = 2
) -> Callable[[np.random.Generator], Trial]:
    """A trial of force histories on the plate, at the six speeds of the cannon.

    Args:
        repeats: impacts at each speed.

    """
    noise = noise or Noise()

    def trial(rng: np.random.Generator) -> Trial:
        records = plate_impacts(ball, rng, repeats=repeats, noise=noise)
        fit = fit_ball(
            records,
            ball.mass.value,
            speed_sigma=noise.speed_sigma,
            group_width=0.01,  # every impact by itself: the speeds of a setting scatter
            speed_low=ball.speed_low.value,
            speed_high=ball.speed_high.value,
        )
        peaks = np.array([i.force.value.max() for g in fit.groups for i in g.impacts])
        return Trial(fit.fields(), fit.rms, noise.force * float(np.sqrt(np.mean(peaks**2))))

    return trial


BALL_FIELDS = ("stiffness_low", "stiffness_growth", "damping_low", "damping_growth")


def ball_truth(ball: BallParameters) -> dict[str, float]:
    """True values of the ball's fitted fields."""
    return {name: float(getattr(ball, name).value) for name in BALL_FIELDS}


def frame_trial(
    racket: RacketParameters,
    direction: str,
    *,
    noise: Noise | None = None,
    strikes: int = 3,
    drake_passes: int = 1,
) -> Callable[[np.random.Generator], Trial]:
    """A trial of hammer strikes on Drake's racket in one direction.

    The strikes are made once, of different size; the noise is new in each trial.
    """
    noise = noise or Noise()
    quiet = replace(noise, force=0.0, acceleration=0.0)
    clean = hammer_strikes(
        racket, direction, np.random.default_rng(0), strikes=strikes, noise=quiet
    )

    def noisy(signal: Signal, share: float, rng: np.random.Generator) -> Signal:
        size = share * float(np.abs(signal.value).max())
        return replace(signal, value=signal.value + size * rng.standard_normal(len(signal.value)))

    def trial(rng: np.random.Generator) -> Trial:
        made = [
            (noisy(force, noise.force, rng), noisy(acceleration, noise.acceleration, rng))
            for force, acceleration in clean
        ]
        records = [hammer_record(force, acceleration) for force, acceleration in made]
        fit = fit_frame(records, racket, direction, drake_passes=drake_passes)
        peaks = np.array([np.abs(a.value).max() for _, a in made])
        off = noise.acceleration * float(np.sqrt(np.mean(peaks**2)))
        return Trial({"kf": fit.kf, "cf": fit.cf}, fit.rms, off)

    return trial


def frame_truth(racket: RacketParameters, direction: str) -> dict[str, float]:
    """True kf and cf."""
    kf, cf = getattr(racket.throat_joint, direction)()
    return {"kf": float(kf), "cf": float(cf)}
