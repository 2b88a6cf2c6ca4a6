"""Stiffness and damping of the ball at one approach speed, from its force on a rigid plate.

Impacts at about the same speed share kb and cb (Glynn et al. 2011: one pair per speed, by the RMS
difference of the force). Two more numbers of each impact are not known exactly and are estimated
with them: the time of touch, which is no sample, and the approach speed, measured to some 0.1 m/s:
0.5 % of the force at 18 m/s, more than all the noise of a record taken together. The measured
speed counts as one more measurement, with its standard deviation. The speed that goes with kb and
cb is the mean of a group's estimates: for a law linear in speed that is exact.

Fitted are the samples surely in contact, so that the model is smooth (`plate_sensitivity`). Not
modelled: the plate's own vibration, filters, and what the mass of the sensor does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from drake_racket.identify.ball.impacts import BallImpact, Contact, check_mass, find_contact
from drake_racket.identify.ball.plate_problem import PlateProblem
from drake_racket.identify.core.least_squares import fit
from drake_racket.identify.core.result import FitResult
from drake_racket.io.errors import InputError
from drake_racket.rigs.force_plate.force import ClosedForm, closed_form

SPEED_SIGMA = 0.1
"""m/s, standard deviation of a measured speed (Glynn et al. 2011: speeds to 0.1 m/s)."""

FIRST_NOISE = 0.01
"""Of the peak: the force's noise before the first fit has told it."""

MOST_PASSES = 8
SETTLED = 0.05  # relative change of the noise: more does not show in any result
ROUNDING = 1e-9  # of the peak: no noise at all


@dataclass(frozen=True)
class SpeedFit:
    """Holds what the impacts at one speed tell.

    Attributes:
        impacts, contacts, masses: the data, in the order of the table.
        result: of kb, cb and the impacts' speeds and times of touch; its residuals end with one
            per speed, scaled to N.
        kb, cb: N/m, N s/m.  speed: m/s, mean of the estimates.
        covariance: (3, 3) of kb, cb and speed.
        speeds, touches: estimates for each impact, m/s and s.
        rms: N, of the force at the fitted samples.

    """

    impacts: tuple[BallImpact, ...]
    contacts: tuple[Contact, ...]
    masses: tuple[float, ...]
    result: FitResult
    kb: float
    cb: float
    speed: float
    covariance: NDArray[np.float64]
    speeds: NDArray[np.float64]
    touches: NDArray[np.float64]
    residuals: NDArray[np.float64]  # (m,) N, of the force
    warnings: tuple[str, ...]

    @property
    def rms(self) -> float:
        """Gives the root mean square of the residuals, N."""
        return float(np.sqrt(np.mean(self.residuals**2)))

    @property
    def peak(self) -> float:
        """Gives the largest sample of all the group's records, N."""
        return max(contact.peak for contact in self.contacts)

    @cached_property
    def closed_forms(self) -> tuple[ClosedForm, ...]:
        """Gives the fitted model of each impact."""
        return tuple(
            closed_form(mass=m, stiffness=self.kb, damping=self.cb, speed=float(v))
            for m, v in zip(self.masses, self.speeds, strict=True)
        )


def fit_speed(
    impacts: Sequence[BallImpact],
    mass: float,
    *,
    speed_sigma: float = SPEED_SIGMA,
    starts: int = 1,
    seed: int = 0,
) -> SpeedFit:
    """Fits kb and cb to impacts at about the same speed.

    Args:
        mass: kg, of the balls that were not weighed.
        speed_sigma: m/s, standard deviation of a measured speed; 0: as measured, without error.
        starts, seed: of the search (`least_squares.fit`).

    Raises:
        InputError: a number out of range, a record that `find_contact` refuses, or a contact
            whose impulse implies a restitution above 1, or none.

    """
    check_mass(mass, "mass")
    if not 0.0 <= speed_sigma <= 5.0:
        raise InputError("speed_sigma", speed_sigma, "0 to 5 m/s")
    if not impacts:
        raise InputError("impacts", 0, "one or more")
    masses = tuple(mass if i.mass is None else i.mass for i in impacts)
    contacts = tuple(find_contact(i, m) for i, m in zip(impacts, masses, strict=True))
    for impact, contact in zip(impacts, contacts, strict=True):
        _check_restitution(impact, contact, speed_sigma)

    # a fit tells the force's noise, against which the measured speeds are weighed in the next
    peak = max(c.peak for c in contacts)
    noise = FIRST_NOISE * peak
    for _ in range(MOST_PASSES):
        asked = PlateProblem(impacts, contacts, masses, speed_sigma=speed_sigma, noise=noise)
        result = fit(asked, starts=starts, seed=seed)
        residuals = asked.force_residuals(result.estimates)
        freedom = max(len(residuals) - len(asked.parameters), 1)
        found = math.sqrt(float(residuals @ residuals) / freedom)
        if asked.held or abs(found - noise) < SETTLED * noise or found < ROUNDING * peak:
            break
        noise = found
    kb, cb, speeds, touches = asked.split(result.estimates)
    return SpeedFit(
        impacts=tuple(impacts),
        contacts=contacts,
        masses=masses,
        result=result,
        kb=kb,
        cb=cb,
        speed=float(speeds.mean()),
        covariance=_covariance(result, 0 if asked.held else len(impacts)),
        speeds=np.array(speeds),
        touches=np.array(touches),
        residuals=residuals,
        warnings=tuple(_warnings(asked, result, residuals, speed_sigma)),
    )


def _covariance(result: FitResult, speeds: int) -> NDArray[np.float64]:
    """Of kb, cb and the mean speed; infinite where one is not determined."""
    known = np.isfinite(np.diag(result.covariance))
    pick = np.zeros((3, len(known)))
    pick[0, 0] = pick[1, 1] = 1.0
    if speeds:
        pick[2, 2 : 2 + speeds] = 1.0 / speeds
    found = pick @ np.where(np.outer(known, known), result.covariance, 0.0) @ pick.T
    unknown = (pick != 0.0) @ ~known
    found[unknown, unknown] = np.inf
    return np.asarray(found)


def _check_restitution(impact: BallImpact, contact: Contact, speed_sigma: float) -> None:
    """Refuses an impulse that no passive ball gives; what the speed's error allows is let pass."""
    margin = 0.01 + 3.0 * (1.0 + contact.restitution) * speed_sigma / impact.speed
    too_low = contact.restitution <= 0.0 and not (contact.begun or contact.cut_off)
    if contact.restitution > 1.0 + margin or too_low:
        raise InputError(
            f"{impact.force.where}: restitution from the impulse",
            round(contact.restitution, 4),
            f"0 to 1 (is {impact.speed:g} m/s its speed, is the force in N, the mass in kg?)",
        )


def _warnings(
    problem: PlateProblem, result: FitResult, left: NDArray[np.float64], speed_sigma: float
) -> list[str]:
    found = list(result.warnings)
    _, _, speeds, touches = problem.split(result.estimates)
    kb, cb = result.estimates[:2]
    rms = float(np.sqrt(np.mean(left**2)))
    for i, (impact, contact) in enumerate(zip(problem.impacts, problem.contacts, strict=True)):
        where, share = impact.force.where, 100.0 * contact.offset / contact.peak
        if contact.begun:
            found.append(f"{where}: the record begins after touch; its time is extrapolated")
        if contact.cut_off:
            found.append(f"{where}: the record ends before release; its end is not fitted")
        if abs(share) > 0.5:
            found.append(f"{where}: {share:+.2g} % of the peak before touch: take the offset away")
        off = float(speeds[i]) - impact.speed
        if abs(off) > 3.0 * speed_sigma and not problem.held:
            found.append(
                f"{where}: the force implies {speeds[i]:.4g} m/s, measured {impact.speed:.4g}: "
                "calibration, mass or the law is off"
            )
        form = closed_form(mass=problem.masses[i], stiffness=kb, damping=cb, speed=float(speeds[i]))
        outside = np.ones(len(impact.force.time), dtype=bool)
        outside[contact.samples] = False
        # where touch may be, the samples are before the jump or behind it
        error = float(result.standard_errors[i - len(touches)])
        near = contact.step + (3.0 * error if math.isfinite(error) else 0.0)
        outside &= np.abs(impact.force.time - touches[i]) > near
        time, force = impact.force.time[outside], impact.force.value[outside]
        if len(time):
            away = float(np.sqrt(np.mean((form.force(time - touches[i]) - force) ** 2)))
            if away > 3.0 * rms + 0.005 * contact.peak:
                found.append(
                    f"{where}: {away:.3g} N (RMS) from the law outside the fitted samples, "
                    f"{rms:.3g} N within: offset, ringing or filter?"
                )
    return found + _correlated(problem, left, rms)


def _correlated(problem: PlateProblem, left: NDArray[np.float64], rms: float) -> list[str]:
    """Residuals that are not noise: neighbours alike."""
    correlation = float(left[1:] @ left[:-1] / max(float(left @ left), np.finfo(float).tiny))
    if correlation < 0.3 or rms < 1e-4 * max(c.peak for c in problem.contacts):
        return []
    return [
        f"{problem.title}: neighbouring residuals are alike (correlation {correlation:.2f}): "
        "the law leaves a part of the force; intervals, which take noise, are too narrow"
    ]
