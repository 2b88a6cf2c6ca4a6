"""The SurfaceContact applies the law of `surface`: a ball that spins, anywhere on a bed."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.multibody.math import SpatialForce_
from pydrake.multibody.plant import ExternallyAppliedSpatialForce_
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import (
    BasicVector_,
    EventStatus,
    LeafSystem_,
    UnrestrictedUpdateEvent_,
    WitnessFunctionDirection,
)
from pydrake.systems.scalar_conversion import TemplateSystem

from drake_racket.io.errors import InputError
from drake_racket.laws.contact import CONTACT, FREE, PASSED, stored_energy
from drake_racket.laws.phases import (
    HB,
    KB,
    NO_TIME,
    PHASE,
    POINT,
    RELEASE,
    TOUCH,
    next_phase,
    value_of,
)
from drake_racket.laws.places import met_weights
from drake_racket.laws.surface import (
    COMPILED_SURFACE,
    COMPILED_SURFACE_MOTION,
    KT,
    NEARLY,
    POINT_0,
    SURFACE_SIZE,
    WEIGHT_0,
    SurfaceModel,
    surface_forces,
    surface_losses,
    surface_motion,
    surface_release,
    surface_switch,
    surface_touch,
)
from drake_racket.plant.systems.ports import ContactPower, ContactState
from drake_racket.plant.systems.scalars import on_float


@dataclass(frozen=True, eq=False)
class SurfaceBodies:
    """Says where a ball and a bed are on a plant.

    Attributes:
        ball, head: indices of the bodies.  strings: of the string masses in the points' order.
        positions, velocities: (n,) places of the masses in the plant's state.
        axes, centre: (3, 3) and (3,) the bed's axes and centre in the head's body.

    """

    ball: int
    head: int
    strings: tuple[int, ...]
    positions: NDArray[np.int64]
    velocities: NDArray[np.int64]
    axes: NDArray[np.float64]
    centre: NDArray[np.float64]


@TemplateSystem.define("SurfaceContact_", scope=sys.modules[__name__])
def SurfaceContact_(T: Any) -> Any:
    """Gives the contact as a LeafSystem on the scalar type T; `SurfaceContact` is it on float.

    Raises:
        InputError: when one is made for a discrete plant.

    """
    spatial_force = SpatialForce_[T]

    class Impl(LeafSystem_[T]):
        """Contact of one ball that has a radius and spins with one string-bed.

        Input ports:
            state: the plant's multibody state [q; v] (m, rad, m/s, rad/s).
        Output ports:
            spatial_forces: list of ExternallyAppliedSpatialForce on ball, four string masses and
                head (the rim's share), all at the contact point; empty when not in contact.
            contact_state (9, ContactState): as of `BallContact`; the point is the nearest one, the
                sliding velocity that of the ball over the strings (0 while they grip).
            stored_energy (1): kb x^2 / 2 + hb x^3 / 3 + kt u^2 / 2 in contact (J).
            power (6, ContactPower): as of `BallContact`; the ball's loss has that of ct in it.
        Numeric parameters:
            0 ball: speed_low, speed_high (m/s), kb (N/m) at speed_low, growth, cb (N s/m), growth,
              hb (N/m^2), db (N s/m^2).
            1 friction: mu at the points in order (1).
            2 surface: R (m), chi (1), kt (N/m), ct (N s/m), alone (`laws.places.met_weights`).
        Continuous state (2): the element u (m).
        Discrete state (32), latched at touch: see `laws.surface`.
        Events: touch, release, leaving, and the turns between gripping and sliding are witness
            functions. A run may start at touch.
        The plant is continuous, else InputError. Equations: `surface`.
        """

        BALL, FRICTION, SURFACE = range(3)
        ELEMENT = 2

        def _construct(
            self, model: SurfaceModel, at: SurfaceBodies, plant: Any, converter: Any = None
        ) -> None:
            if plant.time_step() > 0.0:
                raise InputError(
                    "contact", "surface, on a discrete plant", "a continuous plant (time_step 0)"
                )
            LeafSystem_[T].__init__(self, converter)
            self.model, self.at, self.plant = model, at, plant
            self._scratch = plant.CreateDefaultContext()
            self._seen: Any = None  # the state that the scratch Context has
            self._law_there: Any = None  # record and element, and the law there
            self._ball = plant.get_body(BodyIndex(at.ball))
            self._head = plant.get_body(BodyIndex(at.head))
            self._law: Any = COMPILED_SURFACE if T is float else surface_forces
            self._relative: Any = COMPILED_SURFACE_MOTION if T is float else surface_motion
            for values in (model.ball, model.friction, model.surface):
                self.DeclareNumericParameter(
                    BasicVector_[T](np.array([T(float(x)) for x in values]))
                )
            initial = np.array([T(0.0)] * SURFACE_SIZE)
            initial[TOUCH] = initial[RELEASE] = T(NO_TIME)
            self.DeclareDiscreteState(BasicVector_[T](initial))
            self.DeclareContinuousState(self.ELEMENT)
            self._state = self.DeclareVectorInputPort("state", plant.num_multibody_states())
            self._declare_outputs()
            self._declare_events()

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            plant = other.plant.ToScalarType[T]()
            Impl._construct(self, other.model, other.at, plant, converter=converter)

        def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
            rate = np.array([T(0.0)] * self.ELEMENT)
            record = self._latched(context)
            if record[PHASE] == CONTACT:
                rate[:] = self._contact_law(context, record)[4][3:5]
            derivatives.get_mutable_vector().SetFromVector(rate)

        # ---- forces and outputs

        def _declare_outputs(self) -> None:
            needs = {self._state.ticket(), self.xd_ticket(), self.xc_ticket()}
            force = ExternallyAppliedSpatialForce_[T]
            self._pushes = [force() for _ in range(6)]
            self._pushes[0].body_index = BodyIndex(self.at.ball)
            self._pushes[5].body_index = BodyIndex(self.at.head)
            self._string_index = [BodyIndex(i) for i in self.at.strings]
            self._no_moment = np.array([T(0.0)] * 3)
            self.DeclareAbstractOutputPort(
                "spatial_forces",
                lambda: AbstractValue.Make([force()]),
                self._calc_spatial_forces,
                prerequisites_of_calc=needs,
            )
            needs = needs | {self.all_parameters_ticket()}
            for name, size, calc in (
                ("contact_state", len(ContactState), self._calc_contact_state),
                ("stored_energy", 1, self._calc_stored_energy),
                ("power", len(ContactPower), self._calc_power),
            ):
                self.DeclareVectorOutputPort(name, size, calc, prerequisites_of_calc=needs)

        def _latched(self, context: Any) -> Any:
            return context.get_discrete_state_vector().CopyToVector()

        def element(self, context: Any) -> Any:
            """Gives u (2,) (m) of a Context of this system."""
            return context.get_continuous_state_vector().CopyToVector()

        def _look(self, context: Any) -> Any:
            """Takes the state; one instant is looked at several times, by witnesses and outputs."""
            state = self._state.Eval(context)
            seen = state.tobytes() if T is float else None
            if seen is None or seen != self._seen:
                self.plant.SetPositionsAndVelocities(self._scratch, state)
                self._seen, self._law_there = seen, None
            return state

        def _motions(self) -> Any:
            scratch, head, ball = self._scratch, self._head, self._ball
            return (
                head.EvalPoseInWorld(scratch).GetAsMatrix34(),
                ball.EvalPoseInWorld(scratch).GetAsMatrix34(),
                head.EvalSpatialVelocityInWorld(scratch).get_coeffs(),
                ball.EvalSpatialVelocityInWorld(scratch).get_coeffs(),
                self.at.axes,
                self.at.centre,
            )

        def _contact_law(self, context: Any, record: Any) -> Any:
            """In contact: what `surface_forces` gives."""
            state, u = self._look(context), self.element(context)
            key = record.tobytes() + u.tobytes()
            if self._law_there is None or T is not float or self._law_there[0] != key:
                plain = record.copy()
                for i in range(POINT_0, POINT_0 + 4):
                    plain[i] = value_of(record[i])
                found = self._law(
                    *self._motions(),
                    self.model.grid,
                    state[self.at.positions],
                    state[self.at.velocities],
                    u,
                    plain,
                )
                self._law_there = key, found
            return self._law_there[1]

        def _calc_spatial_forces(self, context: Any, output: Any) -> None:
            record = self._latched(context)
            if record[PHASE] != CONTACT:
                output.set_value([])
                return
            force, down, arms, on_head, _ = self._contact_law(context, record)
            ball, *strings, head = self._pushes
            none = self._no_moment
            ball.F_Bq_W = spatial_force(np.concatenate([none, force]))
            # at C, which is `down` from Q in the world; the ball's own axes turn
            rotation = self._ball.EvalPoseInWorld(self._scratch).rotation().matrix()
            ball.p_BoBq_B = rotation.T @ down
            rim = 1.0
            for i, push in enumerate(strings):
                weight = record[WEIGHT_0 + i]
                rim = rim - weight
                push.body_index = self._string_index[round(value_of(record[POINT_0 + i])) - 1]
                push.F_Bq_W = spatial_force(np.concatenate([none, -weight * force]))
                push.p_BoBq_B = arms[i]
            head.F_Bq_W = spatial_force(np.concatenate([none, -rim * force]))
            head.p_BoBq_B = on_head
            output.set_value(self._pushes)

        def _calc_contact_state(self, context: Any, output: Any) -> None:
            record = self._latched(context)
            output.SetFromVector(np.array([T(x) for x in self.contact_numbers(context, record)]))

        def contact_numbers(self, context: Any, record: Any) -> list[Any]:
            """Gives what the output `contact_state` shows, of a Context and its discrete state."""
            if record[PHASE] == CONTACT:
                f0, f1, fz, s0, s1, c0, c1, _, x, rate, _ = self._contact_law(context, record)[4]
                normal = fz if fz > 0.0 else 0.0 * fz
                point = value_of(record[POINT])
                return [record[PHASE], point, x, rate, normal, f0, f1, c0 - s0, c1 - s1]
            gap, rate, (_, v, _, _), point = self._next_place(context)
            return [record[PHASE], point, -gap, rate, 0.0, 0.0, 0.0, v[0], v[1]]

        def _calc_stored_energy(self, context: Any, output: Any) -> None:
            record = self._latched(context)
            output[0] = T(0.0)
            if record[PHASE] == CONTACT:
                x, u = self._contact_law(context, record)[4][8], self.element(context)
                sheared = 0.5 * record[KT] * (u[0] * u[0] + u[1] * u[1])
                output[0] = stored_energy(x, record[KB], record[HB]) + sheared

        def _calc_power(self, context: Any, output: Any) -> None:
            record = self._latched(context)
            power = np.array([T(0.0)] * len(ContactPower))
            if record[PHASE] == CONTACT:
                force, _, _, _, found = self._contact_law(context, record)
                power[0], power[1] = surface_losses(found, record)
                power[3:] = force
            output.SetFromVector(power)

        # ---- touch, release, leaving; gripping and sliding

        def _declare_events(self) -> None:
            self.DeclareInitializationUnrestrictedUpdateEvent(self._update)
            # a turn between gripping and sliding that no witness saw, within a step
            self.DeclarePerStepUnrestrictedUpdateEvent(self._settle)
            event = UnrestrictedUpdateEvent_[T](system_callback=_dispatch_update)
            falling = WitnessFunctionDirection.kPositiveThenNonPositive
            self._witnesses = {
                FREE: [self.MakeWitnessFunction("touch", falling, self._gap, event)],
                CONTACT: [
                    self.MakeWitnessFunction("release", falling, self._raw_normal, event),
                    self.MakeWitnessFunction("turn", falling, self._goes_on, event),
                ],
                PASSED: [self.MakeWitnessFunction("leaving", falling, self._compression, event)],
            }

        def DoGetWitnessFunctions(self, context: Any) -> list[Any]:
            return self._witnesses[value_of(context.get_discrete_state_vector()[PHASE])]

        def _next_place(self, context: Any) -> Any:
            """Apart: gap (m), rate of compression (m/s), the motion, and the nearest point."""
            state = self._look(context)
            motion = self._relative(*self._motions())
            p, v = motion[0], motion[1]
            model, at = self.model, self.at
            radius, *_, alone = context.get_numeric_parameter(self.SURFACE).CopyToVector()
            points, weights, shares = met_weights(
                model.grid, model.rim, p[0], p[1], value_of(alone)
            )
            z, rate = state[at.positions], state[at.velocities]
            gap, closing = p[2] - radius, -v[2]
            for i in range(4):
                gap = gap - weights[i] * z[points[i]]
                closing = closing + weights[i] * rate[points[i]]
            nearest = points[int(np.argmax([value_of(s) for s in shares]))] + 1
            return gap, closing, motion, nearest

        def _gap(self, context: Any) -> Any:
            return self._next_place(context)[0]

        def _compression(self, context: Any) -> Any:
            return -self._gap(context)

        def _raw_normal(self, context: Any) -> Any:
            return self._contact_law(context, self._latched(context))[4][2]

        def _goes_on(self, context: Any) -> Any:
            return self._contact_law(context, self._latched(context))[4][10]

        def _settle(self, context: Any, new: Any) -> EventStatus:
            record = self._latched(context)
            if record[PHASE] != CONTACT:
                return EventStatus.DidNothing()
            found = self._contact_law(context, record)[4]
            if not found[10] < -NEARLY * abs(found[2]) or found[2] <= 0.0:
                return EventStatus.DidNothing()
            surface_switch(record, context.get_time())
            return self._write(record, new)

        def _update(self, context: Any, new: Any) -> EventStatus:
            """Goes to the phase that the present state asks for."""
            record = self._latched(context)
            phase = value_of(record[PHASE])
            if phase == CONTACT:
                found = self._contact_law(context, record)[4]
                if next_phase(phase, -found[8], 0.0, found[2], True) == CONTACT:
                    if found[10] > 0.0:
                        return EventStatus.DidNothing()
                    surface_switch(record, context.get_time())
                    return self._write(record, new)
                u = self.element(context)
                surface_release(record, found[8], u[0], u[1], context.get_time())
            else:
                gap, closing, (p, v, turn, _), _ = self._next_place(context)
                rim = self.model.rim
                inside = phase == FREE and (p[0] / rim[0]) ** 2 + (p[1] / rim[1]) ** 2 < 1.0
                coming = next_phase(phase, gap, -closing, 0.0, inside)
                if coming == phase:
                    return EventStatus.DidNothing()
                record[PHASE] = coming
                if coming == CONTACT:
                    self._touch(context, record, p, v, turn, closing)
            new.get_mutable_continuous_state().get_mutable_vector().SetFromVector(
                np.array([T(0.0)] * self.ELEMENT)
            )
            return self._write(record, new)

        def _touch(
            self, context: Any, record: Any, p: Any, v: Any, turn: Any, closing: Any
        ) -> None:
            ball, friction, surface = (
                context.get_numeric_parameter(i).CopyToVector()
                for i in (self.BALL, self.FRICTION, self.SURFACE)
            )
            surface = [*surface[:4], value_of(surface[4])]
            grid, rim = self.model.grid, self.model.rim
            now = context.get_time()
            surface_touch(record, p, v, turn, closing, now, ball, friction, surface, grid, rim)

        def _write(self, record: Any, new: Any) -> EventStatus:
            numbers = [x if isinstance(x, T) else T(x) for x in record]
            new.get_mutable_discrete_state().get_mutable_vector().SetFromVector(np.array(numbers))
            return EventStatus.Succeeded()

    return Impl


SurfaceContact = on_float(SurfaceContact_)
"""`SurfaceContact` is `SurfaceContact_` on plain numbers: a ball that spins, on the strings."""


def _dispatch_update(system: Any, context: Any, event: Any, state: Any) -> Any:
    return system._update(context, state)
