"""Computes what Drake's racket does under a hit beyond the linear one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import trapezoid

from drake_racket.identify.frame.hammer_model import HammeredFrame
from drake_racket.identify.frame.hammer_record import HammerRecord
from drake_racket.io.errors import InputError
from drake_racket.parameters.racket import RacketParameters
from drake_racket.rigs.hammer.force import Pulse
from drake_racket.rigs.hammer.impact_hammer import HammerRig, make_hammer_rig

RATES = 1e3, 2e5  # Hz, of rigs.impact_hammer


def check_rates(records: Sequence[HammerRecord]) -> None:
    """Refuses sample rates that the rig does not take."""
    for record in records:
        rate = 1.0 / record.step
        if not RATES[0] <= rate <= RATES[1]:
            allowed = f"{RATES[0]:g} to {RATES[1]:g} Hz, or no passes through Drake"
            raise InputError(f"{record.where}: sample rate", round(rate, 3), allowed)


class DrakeDifference:
    """Holds Drake's rig beside the linear model, built once per length of pulse."""

    def __init__(self, racket: RacketParameters, direction: str, place: float) -> None:
        """Arguments as `rigs.make_hammer_rig`."""
        self.racket, self.direction, self.place = racket, direction, place
        self._rigs: dict[int, HammerRig] = {}

    def acceleration(
        self,
        record: HammerRecord,
        frame: HammeredFrame,
        stiffness: float,
        damping: float,
        gain: float,
    ) -> NDArray[np.float64]:
        """Gives Drake's acceleration less the linear model's over a record, m/s^2.

        Args:
            stiffness: kf, N m/rad.  damping: cf, N m s/rad.
            gain: 1, times the record's force.

        """
        force = gain * record.force
        hit = slice(0, record.after + 1)  # to the first sample that is zero again
        time = record.time[hit]
        pulse = Pulse(
            start=0.0,
            end=float(time[-1]),
            peak=float(force.max()),
            impulse=float(trapezoid(force[hit], time)),
            numbers=np.concatenate([time, force[hit]]),
            sampled=True,
            title=record.where,
        )
        if len(time) not in self._rigs:  # a diagram keeps its pulse's number of samples
            rig = make_hammer_rig(self.racket, self.direction, pulse, place=self.place)
            self._rigs[len(time)] = rig
        strike = self._rigs[len(time)].run(
            pulse,
            joint=(stiffness, damping),
            duration=(len(force) - 1) * record.step,
            rate=1.0 / record.step,
        )
        linear = frame.acceleration(force, record.step, stiffness=stiffness, damping=damping)
        return np.asarray(strike["acceleration"].to_numpy() - linear)
