"""The hammer's force is a pulse over time; a LeafSystem applies it to a body."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.multibody.math import SpatialForce_
from pydrake.multibody.plant import ExternallyAppliedSpatialForce_
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import BasicVector_, LeafSystem_
from pydrake.systems.scalar_conversion import TemplateSystem
from scipy.integrate import trapezoid

from drake_racket.io.errors import InputError
from drake_racket.io.signals import Signal, pulse_extent
from drake_racket.laws.pulse import half_sine_force, sampled_force
from drake_racket.plant.systems.scalars import on_float

MOST_FORCE = 5e3  # N
MOST_SAMPLES = 50_000
SHARE = 0.01  # of its peak: where a sampled pulse begins and ends

INFERRED_PEAK = 100.0
"""The hammer's pulse is so high (N). The source does not print its pulses. Inferred: what a
hand-held hammer with a plastic tip gives on a light frame."""
INFERRED_LENGTH = 1e-3
"""The hammer's pulse is so long (s): inferred like its peak, short beside the modes' 5 to 8 ms."""


@dataclass(frozen=True)
class Pulse:
    """Holds a force over time; make one with `half_sine` or `sampled_pulse`.

    Attributes:
        start, end: s.  peak: N.  impulse: N s, from start to end.
        numbers: what the HammerForce keeps as its numeric parameter: peak and length of a half
            sine, or (2n,) times and forces of n samples.
        sampled: straight between samples, rather than a half sine.
        title: in words.

    """

    start: float
    end: float
    peak: float
    impulse: float
    numbers: NDArray[np.float64]
    sampled: bool
    title: str

    def breaks(self) -> NDArray[np.float64]:
        """Gives the times (s) from start to end where the force or its rate is not smooth."""
        if not self.sampled:
            return np.array([self.start, self.end])
        time = self.numbers[: len(self.numbers) // 2]
        return time[(time >= self.start) & (time <= self.end)]


def half_sine(peak: float = INFERRED_PEAK, length: float = INFERRED_LENGTH) -> Pulse:
    """Computes F = peak sin(pi t / length) from t = 0 to `length`.

    Args:
        peak: N, up to 5 kN.  length: s, 50 us to 50 ms.

    Raises:
        InputError: a number out of range.

    """
    if not 0.0 < peak <= MOST_FORCE:
        raise InputError("peak", peak, f"above 0, up to {MOST_FORCE:g} N")
    if not 5e-5 <= length <= 0.05:
        raise InputError("length", length, "5e-5 to 0.05 s")
    impulse = 2.0 * peak * length / math.pi
    title = f"half sine, {peak:g} N, {1e3 * length:g} ms"
    return Pulse(0.0, length, peak, impulse, np.array([peak, length]), False, title)


def sampled_pulse(signal: Signal) -> Pulse:
    """Gives a measured force, straight between its samples and zero before and after them.

    The pulse is the stretch around the largest sample that stays above 1 % of it, and the sample
    on either side. What the record holds after it acts too: take an offset away first.

    Args:
        signal: N, positive in the direction of the hit.

    Raises:
        InputError: no positive force, above 5 kN, fewer than 20 samples in the pulse, a pulse that
            the record cuts off, longer than 50 ms, or more than 50,000 samples.

    """
    time, force = signal.time, signal.value
    where = f"{signal.where}: {signal.name} [{signal.unit}]"
    if len(force) > MOST_SAMPLES:
        raise InputError(where, f"{len(force)} samples", f"at most {MOST_SAMPLES}")
    first, last = pulse_extent(signal, SHARE)
    peak = float(force.max())
    if peak > MOST_FORCE:
        raise InputError(where, f"a peak of {peak:g} N", f"up to {MOST_FORCE:g} N")
    for i, end in ((first, 0), (last, len(force) - 1)):
        if i == end and force[i] > 0.1 * peak:
            got = f"{force[i]:.4g} N where the record begins or ends"
            raise InputError(where, got, f"the whole pulse, below {0.1 * peak:.4g} N there")
    first, last = max(first - 1, 0), min(last + 1, len(force) - 1)
    if time[last] - time[first] > 0.05:
        raise InputError(where, f"a pulse of {time[last] - time[first]:.3g} s", "up to 0.05 s")
    inside = slice(first, last + 1)
    return Pulse(
        start=float(time[first]),
        end=float(time[last]),
        peak=peak,
        impulse=float(trapezoid(force[inside], time[inside])),
        numbers=np.concatenate([time[first:], force[first:]]),
        sampled=True,
        title=f"{signal.where}, {peak:.4g} N",
    )


@TemplateSystem.define("HammerForce_", scope=sys.modules[__name__])
def HammerForce_(T: Any) -> Any:
    """Gives the hammer as a LeafSystem on the scalar type T; `HammerForce` is that on float."""

    class Impl(LeafSystem_[T]):
        """A force at a point of a body, in a direction that turns with the body.

        Input ports:
            state: the plant's multibody state [q; v]; only the body's orientation is used.
        Output ports:
            spatial_forces: list of one ExternallyAppliedSpatialForce.
            force (1): N.
        Numeric parameters:
            0 pulse: `Pulse.numbers`; a sampled pulse keeps its number of samples.
            1 place: p_BoH_B (m) of the point H that is hit, in the body's frame.
            2 direction: unit vector in the body's frame.
        The force is 0 outside the pulse's time. Its rate jumps at the pulse's `breaks`: end an
        integration step there.
        """

        PULSE, PLACE, DIRECTION = range(3)

        def _construct(
            self,
            pulse: Pulse,
            body: int,
            place: NDArray[np.float64],
            direction: NDArray[np.float64],
            plant: Any,
            converter: Any = None,
        ) -> None:
            LeafSystem_[T].__init__(self, converter)
            self.pulse, self.body, self.place, self.direction = pulse, body, place, direction
            self.plant, self.sampled = plant, pulse.sampled
            self._scratch = plant.CreateDefaultContext()
            self._body = plant.get_body(BodyIndex(body))
            for values in (pulse.numbers, place, direction):
                self.DeclareNumericParameter(
                    BasicVector_[T](np.array([T(float(x)) for x in values]))
                )
            self._state = self.DeclareVectorInputPort("state", plant.num_multibody_states())
            always = {self.time_ticket(), self.all_parameters_ticket()}
            applied = ExternallyAppliedSpatialForce_[T]
            self.DeclareAbstractOutputPort(
                "spatial_forces",
                lambda: AbstractValue.Make([applied()]),
                self._calc_spatial_forces,
                prerequisites_of_calc=always | {self._state.ticket()},
            )
            self.DeclareVectorOutputPort("force", 1, self._calc_force, prerequisites_of_calc=always)

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            plant = other.plant.ToScalarType[T]()
            made_of = other.pulse, other.body, other.place, other.direction, plant
            Impl._construct(self, *made_of, converter=converter)

        def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
            """No continuous state; stated because Drake 1.58 takes 4 us to find no override."""

        def _numbers(self, context: Any, index: int) -> Any:
            return context.get_numeric_parameter(index).CopyToVector()

        def _force(self, context: Any) -> Any:
            law = sampled_force if self.sampled else half_sine_force
            return law(context.get_time(), self._numbers(context, self.PULSE))

        def _calc_force(self, context: Any, output: Any) -> None:
            output[0] = self._force(context)

        def _calc_spatial_forces(self, context: Any, output: Any) -> None:
            self.plant.SetPositionsAndVelocities(self._scratch, self._state.Eval(context))
            R_WB = self._body.EvalPoseInWorld(self._scratch).rotation().matrix()
            force = R_WB @ (self._force(context) * self._numbers(context, self.DIRECTION))
            applied = ExternallyAppliedSpatialForce_[T]()
            applied.body_index = self._body.index()
            applied.p_BoBq_B = self._numbers(context, self.PLACE)
            applied.F_Bq_W = SpatialForce_[T](np.array([T(0.0)] * 3), force)
            output.set_value([applied])

    return Impl


HammerForce = on_float(HammerForce_)
