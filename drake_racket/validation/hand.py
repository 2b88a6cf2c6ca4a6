"""The section on whole rackets and hands: shops' numbers, six segments, a hand with mass."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from drake_racket.io.progress import Progress, Report
from drake_racket.parameters.grip import load_grip
from drake_racket.parameters.overrides import apply_overrides
from drake_racket.parameters.racket import RACKETS, RacketParameters, load_racket
from drake_racket.parameters.scenario import Scenario
from drake_racket.plant.properties import racket_properties
from drake_racket.rigs.modes.modal_analysis import modal_system, solve_modes
from drake_racket.simulation import simulate
from drake_racket.validation.outcome import Plan, SectionResult

SEGMENTS = 6
GRIPS = ("light", "medium", "tight")
SAVAGE = {"A": (183.75, 0.010), "B": (162.5, 0.0115)}
"""Racket -> frequency (Hz) and damping ratio, free (Savage 2006, Appendix 4)."""


def frame_and_hand(plan: Plan, progress: Report) -> SectionResult:
    """Compares whole-racket numbers, and what six segments and a hand with mass give."""
    values: dict[str, float] = {}
    for n, racket in enumerate(RACKETS):
        values |= _shop(racket) | _impacts(racket)
        progress(Progress("", n + 1, len(RACKETS) + 1))
    rackets = {name: _like(*numbers) for name, numbers in SAVAGE.items()}
    for name, like in rackets.items():
        free = SAVAGE[name][0]
        for grip in GRIPS:
            frequency, damping = _held(like, f"hand_{grip}")
            values[f"hand.{grip}.{name}.frequency"] = frequency / free
            values[f"hand.{grip}.{name}.damping"] = damping
    other = _cut(load_racket("recreational"))
    held, free_other = _held(other, "hand_medium"), _held(other, None)
    values["hand.transfer.frequency"] = held[0] / free_other[0]
    values["hand.transfer.damping"] = held[1]
    text = [
        "Shop's numbers are of other specimens than the paper's, with grip tape and bumper; the"
        " paper's frames are lighter and taper otherwise. Impacts here have a frame of six"
        " segments that keeps the parts' printed moments; two segments change restitution at the"
        " centre by 3 % at most.",
        "The hands are fitted to Savage's two rackets, for which the tour racket's masses stand:"
        " those rows show the fit, not a test. The recreational racket in the same medium hand is"
        " one: its node lies farther from the hand.",
    ]
    return SectionResult(values, text)


def _cut(racket: RacketParameters) -> RacketParameters:
    return apply_overrides(racket, {"racket.frame.segments": SEGMENTS})


def _shop(name: str) -> dict[str, float]:
    racket = load_racket(name)
    has = racket_properties(racket)
    modes = solve_modes(modal_system(racket))
    frequency = float(modes.frequencies[modes.bending("out_of_plane")])
    return {
        f"shop.{name}.mass": has.mass,
        f"shop.{name}.balance": has.balance,
        f"shop.{name}.swingweight": has.swingweight,
        f"shop.{name}.twistweight": has.twistweight,
        f"shop.{name}.frequency": frequency,
        f"shop.{name}.kf": racket.throat_joint.out_of_plane()[0],
    }


def _impacts(name: str) -> dict[str, float]:
    base = Scenario(
        racket=name, after=0.01, engine="compiled", overrides={"racket.frame.segments": SEGMENTS}
    )

    def restitution(**keys: Any) -> float:
        return simulate(dataclasses.replace(base, **keys), history=False).apparent_restitution

    stiffness, damping = load_racket(name).throat_joint.out_of_plane()
    stiff = base.overrides | {
        "racket.throat_joint.out_of_plane_stiffness": 2.0 * stiffness,
        "racket.throat_joint.out_of_plane_damping": 2.0 * damping,
    }
    centre, slow = restitution(), restitution(speed=15.0)
    light, tight = (
        restitution(support="grip", grip_kind="hand", grip=f"hand_{grip}")
        for grip in ("light", "tight")
    )
    two = dataclasses.replace(base, overrides={})
    values = {
        f"shop.{name}.restitution": simulate(two, history=False).apparent_restitution,
        f"hand.{name}.grip": tight / light - 1.0,
        f"hand.{name}.stiffness": restitution(overrides=stiff) / centre - 1.0,
    }
    for place, point in (("throat", "8"), ("centre", "5"), ("tip", "2")):
        values[f"places.{name}.{place}"] = restitution(speed=12.5, point=point)
    for mm in (25, 50):
        aside = restitution(speed=15.0, point="auto", offset_y=1e-3 * mm)
        values[f"aside.{name}.{mm}"] = aside / slow - 1.0
    return values


def _like(frequency: float, damping: float) -> RacketParameters:
    """The tour racket's masses in six segments, with a strung, free frequency and damping."""
    tour = load_racket("tour")
    stiffness, _ = tour.throat_joint.out_of_plane()

    def scaled(factor: float) -> RacketParameters:
        loss = damping / (np.pi * frequency)  # s, damping over stiffness
        keys = {
            "racket.throat_joint.out_of_plane_stiffness": factor * stiffness,
            "racket.throat_joint.out_of_plane_damping": factor * stiffness * loss,
        }
        return apply_overrides(_cut(tour), keys)

    factor = 1.0
    for _ in range(4):  # a strung frame's frequency is nearly as the root of its stiffness
        factor *= (frequency / _held(scaled(factor), None)[0]) ** 2
    return scaled(factor)


def _held(racket: RacketParameters, grip: str | None) -> tuple[float, float]:
    """Damped frequency (Hz) and damping ratio of the first bending, free or in a hand."""
    held = None if grip is None else load_grip(grip)
    modes = solve_modes(modal_system(racket, support="grip" if held else "free", grip=held))
    shares = modes.strain_shares[:, modes.elements.index("out_of_plane")]
    at = int(np.argmax(np.where(modes.frequencies < 300.0, shares, -1.0)))
    return float(modes.damped_frequencies[at]), float(modes.damping_ratios[at])
