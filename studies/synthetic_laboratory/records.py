"""Synthetic records: a ball on the force plate, the hammer on the frame; errors as `laboratory`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from drake_racket import BallParameters, InputError, RacketParameters, Signal
from drake_racket.engines import contact_constants
from drake_racket.identify import BallImpact
from drake_racket.rigs import (
    AFTER,
    BEFORE,
    CANNON_SPEEDS,
    DURATION,
    HAMMER_SAMPLE_RATE,
    INFERRED_LENGTH,
    INFERRED_PEAK,
    PLATE_SAMPLE_RATE,
    closed_form,
    half_sine,
    make_hammer_rig,
    sample_times,
)
from studies.synthetic_laboratory.laboratory import Noise, check_request, write_columns

HAMMER_BEFORE = 2e-3
"""s of the hammer's record before the pulse, as a trigger keeps them."""


def plate_impacts(
    ball: BallParameters,
    rng: np.random.Generator,
    *,
    speeds: Sequence[float] = CANNON_SPEEDS,
    repeats: int = 1,
    noise: Noise | None = None,
    rate: float = PLATE_SAMPLE_RATE,
) -> list[BallImpact]:
    """Impacts on a rigid force plate (`rigs.plate_force`): force over time and measured speed.

    Touch falls anywhere between two samples. The sensor's noise is white.

    Raises:
        InputError: a speed, rate or number of repeats out of range.

    """
    noise = noise or Noise()
    check_request((1,), speeds, repeats)
    time = sample_times(rate, BEFORE, AFTER)
    found = []
    for nominal in speeds:
        for n in range(repeats):
            speed = nominal + rng.uniform(-noise.scatter, noise.scatter)
            kb, cb = contact_constants(ball, speed)
            form = closed_form(mass=ball.mass.value, stiffness=kb, damping=cb, speed=speed)
            force = form.force(time - rng.uniform(0.0, 1.0 / rate))
            force += noise.force * form.peak_force * rng.standard_normal(len(time))
            where = f"impact_{nominal:04.1f}_{n + 1}".replace(".", "p")
            measured = float(speed + noise.speed_errors(rng, ()))
            found.append(BallImpact(Signal(time, force, "force", "N", where), measured))
    return found


def hammer_strikes(
    racket: RacketParameters,
    direction: str,
    rng: np.random.Generator,
    *,
    strikes: int = 3,
    noise: Noise | None = None,
    rate: float = HAMMER_SAMPLE_RATE,
    duration: float = DURATION,
) -> list[tuple[Signal, Signal]]:
    """Strikes with the impact hammer (`rigs.impact_hammer`): force in, acceleration out.

    Half sines of inferred size and length; both sensors' noise is white. The record begins
    HAMMER_BEFORE the pulse, the racket at rest.

    Raises:
        InputError: an unknown direction, or a number out of range.

    """
    noise = noise or Noise()
    if not 1 <= strikes <= 100:
        raise InputError("strikes", strikes, "1 to 100")
    rig = make_hammer_rig(racket, direction)
    quiet = round(HAMMER_BEFORE * rate)
    found = []
    for n in range(strikes):
        peak = INFERRED_PEAK * (1.0 + rng.uniform(-noise.strikes, noise.strikes))
        strike = rig.run(half_sine(peak, INFERRED_LENGTH), duration=duration, rate=rate)
        time = np.arange(-quiet, strike.sizes["time"]) / rate
        pair = []
        for name, unit, share in (
            ("force", "N", noise.force),
            ("acceleration", "m/s^2", noise.acceleration),
        ):
            value = np.concatenate([np.zeros(quiet), strike[name].to_numpy()])
            value += share * np.abs(value).max() * rng.standard_normal(len(value))
            pair.append(Signal(time, value, name, unit, f"{direction}_{n + 1}"))
        found.append((pair[0], pair[1]))
    return found


def write_plate_impacts(impacts: Sequence[BallImpact], directory: Path) -> Path:
    """Writes a CSV per impact and the table `impacts.csv`; returns the table's path."""
    directory.mkdir(parents=True, exist_ok=True)
    names = [f"{impact.force.where}.csv" for impact in impacts]
    for impact, name in zip(impacts, names, strict=True):
        signal = impact.force
        write_columns(directory / name, {"time [s]": signal.time, "force [N]": signal.value})
    table = directory / "impacts.csv"
    write_columns(table, {"file": names, "speed [m/s]": [impact.speed for impact in impacts]})
    return table


def write_hammer_strike(strike: tuple[Signal, Signal], path: Path) -> None:
    """Writes the CSV of one strike."""
    force, acceleration = strike
    write_columns(
        path,
        {
            "time [s]": force.time,
            "force [N]": force.value,
            "acceleration [m/s^2]": acceleration.value,
        },
    )
