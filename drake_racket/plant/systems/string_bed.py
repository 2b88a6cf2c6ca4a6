"""The StringBed applies the law of `strings` on a bed of `bed`, with its numbers."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import Value
from pydrake.systems.framework import BasicVector_, LeafSystem_, ValueProducer
from pydrake.systems.scalar_conversion import TemplateSystem

from drake_racket.laws.bed import BedTopology
from drake_racket.laws.compilation import HAS_NUMBA, compiled
from drake_racket.laws.strings import (
    add_bent_forces,
    add_generalized_forces,
    bent_energy,
    bent_forces,
    bent_stretch,
    dissipated_power,
    generalized_forces,
    stored_energy,
    tensions,
)
from drake_racket.plant.systems.scalars import on_float


@dataclass(frozen=True)
class StringBedModel:
    """Holds the numbers of a string-bed, ready for the system below.

    Attributes:
        topology: of its n points and m springs.
        stiffness: k1.. (N/m).  rim_factors: p1.., factors of the rim springs.
        stiffness_index, rim_factor_index: (m,) 0-based; a rim factor index of -1 means none.
        initial_tension: T0 (N).  damping: c (N s/m).
        lengths: (m,) rest lengths (m).
        arms: (m, j) rate of a spring's height per angle of j joints of the frame (m/rad): where the
            rim that it ends on bends away from the masses' plane. Empty (m, 0) of a rigid head.
        folds: (m, j, j) F of `laws.strings` (m^2).

    """

    topology: BedTopology
    stiffness: NDArray[np.float64]
    rim_factors: NDArray[np.float64]
    stiffness_index: NDArray[np.int64]
    rim_factor_index: NDArray[np.int64]
    initial_tension: float
    damping: float
    lengths: NDArray[np.float64]
    arms: NDArray[np.float64]
    folds: NDArray[np.float64]

    @property
    def incidence(self) -> NDArray[np.float64]:
        """Gives (m, n + j) A with dz = A [z; q]: of the topology, and of the frame's joints."""
        return np.concatenate([self.topology.incidence, self.arms], axis=1)


def spring_constants(model: StringBedModel) -> NDArray[np.float64]:
    """Gives the (4, m) constants of the law (see `strings.tensions`) of a string-bed's numbers."""
    k, p = np.asarray(model.stiffness, dtype=float), np.asarray(model.rim_factors, dtype=float)
    constants: NDArray[np.float64] = _resolve(
        model, k, p, [model.initial_tension], [model.damping], model.lengths
    )
    return constants


def _resolve(model: StringBedModel, k: Any, p: Any, t0: Any, c: Any, length0: Any) -> Any:
    """Named parameters into the constants of the law; T0 and c as arrays of one."""
    factors = np.append(p, 1.0 + 0.0 * k[0])  # index -1: a spring without a rim factor
    stiffness = k[model.stiffness_index] * factors[model.rim_factor_index]
    slack = t0[0] - stiffness * length0  # tension that a spring would have at no length
    return np.stack([stiffness, slack, length0 * length0, np.array([c[0]] * len(stiffness))])


@dataclass(frozen=True)
class StringCoordinates:
    """Says where string joints, then frame joints of `arms`, are in the state vector [q; v]."""

    positions: NDArray[np.int64]  # (n + j,) indices into q
    velocities: NDArray[np.int64]  # (n + j,) indices into v
    num_positions: int
    num_velocities: int


_COMPILED = compiled(add_generalized_forces) if HAS_NUMBA else None
_BENT = compiled(add_bent_forces) if HAS_NUMBA else None


@TemplateSystem.define("StringBed_", scope=sys.modules[__name__])
def StringBed_(T: Any) -> Any:
    """Gives the string-bed as a LeafSystem. See `StringBed` for ports and parameters."""

    class Impl(LeafSystem_[T]):
        """Springs of one string-bed, as generalized forces on its plant.

        Input ports:
            state: the plant's multibody state [q; v] (m, rad, m/s, rad/s).
        Output ports:
            generalized_force (nv): forces on the string joints (N) and, where springs end on a
                rim that bends, torques on the frame's joints (N m); zero elsewhere.
            string_tension (m): N, in the order of the topology's springs.
            string_deflection (n): m, of the masses along the head's z.
            string_energy (2): stored energy (J), power lost in string damping (W).
        Numeric parameters:
            0 stiffness k1.. (N/m); 1 rim_factors p1.. (1); 2 initial_tension T0 (N);
            3 damping c (N s/m); 4 lengths (m) L0 (m).
        Equations: `strings`. Source: Glynn et al. 2011.
        """

        STIFFNESS, RIM_FACTORS, INITIAL_TENSION, DAMPING, LENGTHS = range(5)

        def _construct(
            self, model: StringBedModel, at: StringCoordinates, converter: Any = None
        ) -> None:
            LeafSystem_[T].__init__(self, converter)
            self.model = model
            self.at = at
            self._ends, self._incidence = model.topology.ends, model.incidence
            self._rigid = model.arms.size == 0
            self._rows = at.positions, at.num_positions + at.velocities, at.velocities
            self._q, self._v, self._out = map(_as_slice, self._rows)
            self._force = np.array([T(0.0)] * at.num_velocities)  # 0 but for the masses
            for values in (
                model.stiffness,
                model.rim_factors,
                [model.initial_tension],
                [model.damping],
                model.lengths,
            ):
                self.DeclareNumericParameter(BasicVector_[T](np.array([T(x) for x in values])))
            self._springs = self.DeclareCacheEntry(
                description="spring constants",
                value_producer=ValueProducer(allocate=Value[object], calc=self._calc_springs),
                prerequisites_of_calc={self.all_parameters_ticket()},
            )
            size = at.num_positions + at.num_velocities
            self._state = self.DeclareVectorInputPort("state", size)
            needs = {self._state.ticket(), self.all_parameters_ticket()}
            for name, count, calc in (
                ("generalized_force", at.num_velocities, self._calc_force),
                ("string_tension", len(model.topology.names), self._calc_tensions),
                ("string_deflection", len(model.topology.points), self._calc_deflections),
                ("string_energy", 2, self._calc_energy),
            ):
                self.DeclareVectorOutputPort(name, count, calc, prerequisites_of_calc=needs)

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            Impl._construct(self, other.model, other.at, converter=converter)

        def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
            """No continuous state. Stated because Drake 1.58 takes 4 us to find no override."""

        def spring_constants(self, context: Any) -> Any:
            """The (4, n) constants of the law in a Context of this system."""
            return self._springs.Eval(context).copy()

        def _calc_springs(self, context: Any, value: Any) -> None:
            """Resolves the named parameters into the (4, m) constants of the law."""
            k, p, t0, c, length0 = (
                context.get_numeric_parameter(i).CopyToVector() for i in range(5)
            )
            value.set_value(_resolve(self.model, k, p, t0, c, length0))

        def _calc_force(self, context: Any, output: Any) -> None:
            state, springs = self._state.Eval(context), self._springs.Eval(context)
            force = self._force
            if T is float and _BENT is not None and not self._rigid:
                q, v, rows = self._rows
                arms, folds = self.model.arms, self.model.folds
                _BENT(state, q, v, springs, self._ends, arms, folds, force, rows)
            elif not self._rigid:
                z, zdot, folds = state[self._q], state[self._v], self.model.folds
                force[self._out] = bent_forces(z, zdot, springs, self._incidence, folds)
            elif T is float and _COMPILED is not None:
                q, v, rows = self._rows
                _COMPILED(state, q, v, springs, self._ends, force, rows)
            else:
                z, zdot = state[self._q], state[self._v]
                force[self._out] = generalized_forces(z, zdot, springs, self._incidence)
            output.SetFromVector(force)

        def _calc_tensions(self, context: Any, output: Any) -> None:
            state = self._state.Eval(context)
            springs = self._springs.Eval(context)
            z, zdot = state[self._q], state[self._v]
            if self._rigid:
                output.SetFromVector(tensions(z, zdot, springs, self._incidence))
            else:
                output.SetFromVector(self._bent(z, zdot, springs)[3])

        def _calc_deflections(self, context: Any, output: Any) -> None:
            heights = self._state.Eval(context)[self._q]
            output.SetFromVector(heights[: len(self.model.topology.points)])

        def _calc_energy(self, context: Any, output: Any) -> None:
            state = self._state.Eval(context)
            springs = self._springs.Eval(context)
            z, zdot = state[self._q], state[self._v]
            if self._rigid:
                output[0] = stored_energy(z, springs, self._incidence)
                output[1] = dissipated_power(z, zdot, springs, self._incidence)
                return
            dz, sag, stretching, _ = self._bent(z, zdot, springs)
            output[0] = np.sum(bent_energy(dz, sag, springs))
            output[1] = np.sum(springs[3] * stretching * stretching)

        def _bent(self, z: Any, zdot: Any, springs: Any) -> tuple[Any, Any, Any, Any]:
            """Heights (m), sags (m^2), rates of length (m/s) and tensions (N) over a bent frame."""
            count = self.model.folds.shape[1]
            folded = self.model.folds @ z[-count:]
            dz, rate = self._incidence @ z, self._incidence @ zdot
            sag = np.sum(folded * z[-count:], axis=1)
            flow = np.sum(folded * zdot[-count:], axis=1)
            length, tension = bent_stretch(dz, rate, sag, flow, springs)
            return dz, sag, (dz * rate - flow) / length, tension

    return Impl


StringBed = on_float(StringBed_)
"""`StringBed` is `StringBed_` on plain numbers: the forces of the strings."""


def _as_slice(indices: NDArray[np.int64]) -> Any:
    """A slice if the indices run up in steps of one (a view is faster than a gather)."""
    first = int(indices[0])
    if np.array_equal(indices, np.arange(first, first + len(indices))):
        return slice(first, first + len(indices))
    return indices
