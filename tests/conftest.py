"""Shared helpers: the oracles' inputs from the package's parameter files."""

from __future__ import annotations

import csv
import functools
import gc
import runpy
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import typer.main

from drake_racket.io.signals import Signal
from drake_racket.laws.bed import grid_topology
from drake_racket.parameters.ball import BallParameters, load_ball
from drake_racket.parameters.racket import RacketParameters, load_racket
from drake_racket.plant.string_bed import string_bed_model
from tests.oracles.clamped_impact import ClampedImpact
from tests.oracles.free_racket import FreeRacketParams

# what is imported stays: to look through it for garbage again and again takes a tenth of the time
gc.set_threshold(50_000, 20, 100)

# to make the command line's parser takes longer than what most tests ask of it
typer.main.get_command = functools.cache(typer.main.get_command)

ROOT = Path(__file__).resolve().parent.parent
"""The checkout."""

BED = grid_topology()
"""Of the paper."""

SPRINGS = {n: (i + 1, j + 1) for n, (i, j) in zip(BED.names, BED.ends.T.tolist(), strict=True)}
"""Name of each of its springs -> point, point or 0 for the rim."""

BEDS = [(r, t) for r in ("tour", "recreational") for t in ("low", "high")]


@pytest.fixture(params=BEDS, ids=lambda bed: "-".join(bed))
def bed(request: pytest.FixtureRequest) -> tuple[str, str]:
    return request.param


@pytest.fixture
def refused_by_study(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> Callable[..., str]:
    """Runs a study with options that are wrong, in this process; returns the line that it says."""

    def call(name: str, *arguments: object) -> str:
        monkeypatch.setattr(sys, "argv", [name, *map(str, arguments)])
        script = ROOT / "studies" / name
        run, what = runpy.run_module, f"studies.{name}"
        if script.is_file():
            run, what = runpy.run_path, str(script)
        with pytest.raises(SystemExit) as stopped:
            run(what, run_name="__main__")
        said = capfd.readouterr().err
        assert stopped.value.code == 2, said
        assert said.count("\n") == 1, said
        return said

    return call


def kb_cb(ball: BallParameters, speed: float) -> tuple[float, float]:
    """kb and cb at a speed within 18-33 m/s: straight lines through 18 m/s."""
    share = (speed - 18.0) / 15.0
    kb = ball.stiffness_low.value * (1.0 + 0.52 * share)
    cb = ball.damping_low.value * (1.0 + 0.97 * share)
    return kb, cb


def grid_xy(racket: RacketParameters) -> np.ndarray:
    s = racket.string_bed.spacing.value
    return np.array([(row * s, column * s) for row in (1, 0, -1) for column in (1, 0, -1)])


def springs(racket: RacketParameters) -> dict[str, np.ndarray]:
    """The 24 springs as the oracles take them; the rim is -1."""
    model = string_bed_model(racket)
    factors = np.append(model.rim_factors, 1.0)
    pairs = model.topology.ends
    return {
        "spring_i": pairs[0],
        "spring_j": pairs[1],
        "spring_k": model.stiffness[model.stiffness_index] * factors[model.rim_factor_index],
        "spring_L0": model.lengths,
    }


def clamped_problem(racket: str, tension: str, point: int, speed: float) -> ClampedImpact:
    parameters, ball = load_racket(racket, tension), load_ball()
    kb, cb = kb_cb(ball, speed)
    return ClampedImpact(
        grid_xy=grid_xy(parameters),
        **springs(parameters),
        T0=parameters.string_bed.initial_tension.value,
        string_mass=parameters.string_bed.mass.value / 9.0,
        ball_mass=ball.mass.value,
        kb=kb,
        cb=cb,
        point=point - 1,
        v0=speed,
    )


def free_parameters(
    racket: str, tension: str, point: int, speed: float, friction: str, reaction_at: str
) -> FreeRacketParams:
    p, ball = load_racket(racket, tension), load_ball()
    kb, cb = kb_cb(ball, speed)
    (k_z, c_z), (k_y, c_y) = p.throat_joint.in_plane(), p.throat_joint.out_of_plane()

    def inertia(part):
        return np.array(
            [part.moi_longitudinal.value, part.moi_transverse.value, part.moi_frontal.value]
        )

    return FreeRacketParams(
        handle_mass=p.handle.mass.value,
        handle_length=p.handle.length.value,
        handle_com=p.handle.com.value,
        handle_inertia=inertia(p.handle),
        head_mass=p.head.mass.value,
        head_com=p.head.com.value,
        head_inertia=inertia(p.head),
        k_z=k_z,
        c_z=c_z,
        k_y=k_y,
        c_y=c_y,
        gsc=p.string_bed.gsc.value,
        grid_xy=grid_xy(p),
        string_mass=p.string_bed.mass.value / 9.0,
        **springs(p),
        T0=p.string_bed.initial_tension.value,
        ball_mass=ball.mass.value,
        kb=kb,
        cb=cb,
        mu=p.friction_coefficients()[point - 1],
        contact_index=point - 1,
        eps_v=ball.sliding_speed_scale.value,
        eps_d=ball.sliding_distance_scale.value,
        friction=friction,
        reaction_at=reaction_at,
    )


def write_signal(signal: Signal, path: Path) -> None:
    """Writes a CSV that `read_signal` reads back to the last bit."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["time [s]", f"{signal.name} [{signal.unit}]"])
        writer.writerows(zip(signal.time.tolist(), signal.value.tolist(), strict=True))
