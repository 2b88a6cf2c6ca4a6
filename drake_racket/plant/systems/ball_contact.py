"""The BallContact applies the laws of `contact` and `phases`: events and forces."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
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

from drake_racket.laws.contact import (
    COMPILED_CONTACT,
    COMPILED_MOTION,
    CONTACT,
    FREE,
    PASSED,
    contact_forces,
    contact_powers,
    relative_motion,
    stored_energy,
)
from drake_racket.laws.phases import (
    ACTING,
    AT_BALL,
    CB,
    CONSTANTS,
    DB,
    DISCRETE_SIZE,
    HB,
    KB,
    LEAD,
    NO_TIME,
    PHASE,
    POINT,
    RATE,
    RELEASE,
    SEEN,
    SIZE,
    SPIN,
    TOUCH,
    WEIGHT,
    ContactBodies,
    ContactModel,
    inside_rim,
    late_release,
    late_touch,
    nearest_point,
    next_phase,
    release,
    touch,
    value_of,
)
from drake_racket.plant.systems.ports import ContactPower, ContactState
from drake_racket.plant.systems.scalars import on_float


@TemplateSystem.define("BallContact_", scope=sys.modules[__name__])
def BallContact_(T: Any) -> Any:
    """Gives ball contact as a LeafSystem on the scalar type T; `BallContact` is that on float."""
    spatial_force = SpatialForce_[T]  # looked up once: it is called at every evaluation

    class Impl(LeafSystem_[T]):
        """Contact of one ball with the masses of one string-bed.

        Input ports:
            state: the plant's multibody state [q; v] (m, rad, m/s, rad/s).
        Output ports:
            spatial_forces: list of ExternallyAppliedSpatialForce on ball and string mass; empty
                when not in contact (then the state is not looked at).
            contact_state (9, ContactState): phase; point in contact, or to be hit (from 1);
                compression x (m); its rate (m/s); N (N); F_x, F_y on the ball (N) and sliding
                velocity v_x, v_y (m/s) in the head's axes.
            stored_energy (1): kb x^2 / 2 + hb x^3 / 3 in contact (J).
            power (6, ContactPower): lost in the ball's damper, lost to friction, gained from the
                couple (W); and the force on the ball in the world (N), the rate of its impulse.
                The couple: with the reaction at the string mass the two opposite forces act along
                different lines once the ball has slid, which is work from nowhere. It is 0 with
                the reaction at the ball.
        Numeric parameters:
            0 ball: speed_low, speed_high (m/s), kb (N/m) at speed_low, growth, cb (N s/m), growth,
              hb (N/m^2), db (N s/m^2).
            1 friction: mu at the points in order (1).
            2 scales: s_v (m/s), s_d (m).
            3 choices: point (0: the nearest at touch); friction reading (0 velocity, 1
              displacement); reaction (0 at the string mass, 1 at the ball).
        Discrete state (17; 37 on a discrete plant), latched at touch: phase, point, normal
            approach speed at first touch (m/s), kb, cb, mu, tangential offset x, y (m), scale,
            friction reading, hb, db, reaction, time of first touch, time of last release (s),
            energy given up at releases (J), number of touches.
        Events: touch, release and leaving are witness functions on a continuous plant, and checked
            at every update of a discrete one, whatever steps a Simulator takes in between. A run
            may start at touch.
        Discrete plant: its steps of h leave the velocities half a step behind the positions, and
            see a touch up to h late. The contact makes up for both, and is of second order: it
            takes its relative velocity forward by half of the last step's change, and the first
            force, which acts from the touch (x / x' ago) to the middle of the next step, counts
            1/2 + x / (x' h) times. Twenty more discrete states hold that weight, the relative
            velocity as seen and what is added to it (m/s, in the head), the time of both, what
            acts over the step (damper; friction, two; couple per spin, three; force in the world,
            three), and the spin of the head where it begins. The plant may take its step before
            or together with this system's update (that differs between its settings): outputs
            look at the state as the update of the instant leaves it. Not so the power: it is
            what acts over the step at the mean of the velocities before and after it, until the
            next update; so its work and impulse are those that the plant's bodies receive.
        Equations: `contact`. Source: Glynn et al. 2011.
        """

        BALL, FRICTION, SCALES, CHOICES = range(4)

        def _construct(
            self, model: ContactModel, at: ContactBodies, plant: Any, converter: Any = None
        ) -> None:
            LeafSystem_[T].__init__(self, converter)
            self.model, self.at, self.plant = model, at, plant
            # the point from whose string mass "nearest" is looked for: the one nearest the centre
            self._middle = nearest_point(model.grid, 0.0, 0.0)
            self.discrete = plant.time_step() > 0.0
            self._scratch = plant.CreateDefaultContext()
            self._seen: Any = None  # the state that the scratch Context has
            self._next: Any = None  # the choice of point, and what is next to be hit there
            self._law_there: Any = None  # the record, and motion and law in contact there
            self._ball = plant.get_body(BodyIndex(at.ball))
            self._strings = [plant.get_body(BodyIndex(i)) for i in at.strings]
            self._law: Any = COMPILED_CONTACT if T is float else contact_forces
            self._relative: Any = COMPILED_MOTION if T is float else relative_motion
            choices = (model.point, model.by_displacement, model.reaction_at_ball)
            for values in (model.ball, model.friction, model.scales, choices):
                self.DeclareNumericParameter(
                    BasicVector_[T](np.array([T(float(x)) for x in values]))
                )
            initial = np.array([T(0.0)] * (DISCRETE_SIZE if self.discrete else SIZE))
            initial[TOUCH] = initial[RELEASE] = T(NO_TIME)
            if self.discrete:
                initial[SEEN] = T(NO_TIME)
            self.DeclareDiscreteState(BasicVector_[T](initial))
            self._state = self.DeclareVectorInputPort("state", plant.num_multibody_states())
            self._declare_outputs()
            self._declare_events()

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            plant = other.plant.ToScalarType[T]()
            Impl._construct(self, other.model, other.at, plant, converter=converter)

        def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
            """No continuous state. Stated because Drake 1.58 takes 4 us to find no override."""

        # ---- forces and outputs

        def _declare_outputs(self) -> None:
            needs = {self._state.ticket(), self.xd_ticket()}
            if self.discrete:
                needs |= {self.time_ticket(), self.all_parameters_ticket()}
            force = ExternallyAppliedSpatialForce_[T]
            self._on_ball, self._on_string = force(), force()
            self._on_ball.body_index = BodyIndex(self.at.ball)
            self._on_ball.p_BoBq_B = np.array([T(0.0)] * 3)  # Drake leaves it unset
            self._string_index = [BodyIndex(i) for i in self.at.strings]
            self._no_power = np.array([T(0.0)] * 6)
            self.DeclareAbstractOutputPort(
                "spatial_forces",
                lambda: AbstractValue.Make([force()]),
                self._calc_spatial_forces,
                prerequisites_of_calc=needs,
            )
            # before contact, the state names the next point, which is a parameter
            all_needs = needs | {self.all_parameters_ticket()}
            for name, size, calc in (
                ("contact_state", len(ContactState), self._calc_contact_state),
                ("stored_energy", 1, self._calc_stored_energy),
                ("power", len(ContactPower), self._calc_power),
            ):
                self.DeclareVectorOutputPort(name, size, calc, prerequisites_of_calc=all_needs)

        def _motion(self, context: Any, point: int) -> Any:
            """X_WS, X_WQ, V_WS, V_WQ as arrays, for the string mass of `point` and the ball.

            From the state in a Context of this system's own: for two bodies that is less work
            than the plant's ports, which hand all bodies over to Python.
            """
            self._look(context)
            scratch, mass, ball = self._scratch, self._strings[point - 1], self._ball
            return (
                mass.EvalPoseInWorld(scratch).GetAsMatrix34(),
                ball.EvalPoseInWorld(scratch).GetAsMatrix34(),
                mass.EvalSpatialVelocityInWorld(scratch).get_coeffs(),
                ball.EvalSpatialVelocityInWorld(scratch).get_coeffs(),
            )

        def _look(self, context: Any) -> None:
            """Takes the state; one instant is looked at several times, by witnesses and outputs."""
            state = self._state.Eval(context)
            seen = state.tobytes() if T is float else None
            if seen is None or seen != self._seen:
                self.plant.SetPositionsAndVelocities(self._scratch, state)
                self._seen, self._next, self._law_there = seen, None, None

        def _contact_law(self, context: Any, state: Any) -> Any:
            """In contact: the motion, on a discrete plant brought up to time, and its law."""
            self._look(context)
            key = state.tobytes()
            if self._law_there is None or self._law_there[0] != key:
                motion = self._motion(context, round(value_of(state[POINT])))
                if self.discrete:
                    motion = self._led(motion, state[LEAD])
                self._law_there = key, motion, self._law(*motion, state[CONSTANTS])
            return self._law_there[1:]

        def _led(self, motion: Any, lead: Any) -> Any:
            """`motion` with `lead` (m/s, in the head) added to the ball's velocity."""
            x_s, x_q, v_s, v_q = motion
            return x_s, x_q, v_s, v_q + np.concatenate([0.0 * lead, x_s[:, :3] @ lead])

        def latched(self, context: Any, state: Any = None) -> Any:
            """Gives the discrete state; on a discrete plant, as this instant's update leaves it."""
            if state is None:
                state = context.get_discrete_state_vector().CopyToVector()
            if self.discrete and not self._since_update(context, state) < 1.0 - 1e-6:
                self._advance(context, state)
            return state

        def _since_update(self, context: Any, state: Any) -> float:
            """Time since the last update in steps of a discrete plant; inf before the first one."""
            since = value_of(context.get_time()) - value_of(state[SEEN])
            return since / self.plant.time_step() if since >= 0.0 else math.inf

        def _calc_spatial_forces(self, context: Any, output: Any) -> None:
            state = self.latched(context)
            if state[PHASE] != CONTACT:
                output.set_value([])
                return
            point = round(value_of(state[POINT]))
            on_ball, on_string = self._on_ball, self._on_string
            ball, string, p, _, _ = self._contact_law(context, state)[1]
            if self.discrete:
                ball, string = state[WEIGHT] * ball, state[WEIGHT] * string
            on_ball.F_Bq_W = spatial_force(ball)
            on_string.F_Bq_W = spatial_force(string)
            on_string.body_index = self._string_index[point - 1]
            on_string.p_BoBq_B = p if state[AT_BALL] > 0.5 else 0.0 * p
            output.set_value([on_ball, on_string])

        def _calc_contact_state(self, context: Any, output: Any) -> None:
            state = context.get_discrete_state_vector().CopyToVector()
            output.SetFromVector(np.array([T(x) for x in self.contact_numbers(context, state)]))

        def contact_numbers(self, context: Any, state: Any) -> list[Any]:
            """Gives what the output `contact_state` shows, of a Context and a copy of its state."""
            state = self.latched(context, state)
            if state[PHASE] == CONTACT:
                point = round(value_of(state[POINT]))
                _, _, p, v, (fx, fy, normal, _) = self._contact_law(context, state)[1]
            else:
                point, p, v = self._next_point(context)
                fx = fy = normal = 0.0
            return [state[PHASE], point, -p[2], -v[2], normal, fx, fy, v[0], v[1]]

        def _calc_stored_energy(self, context: Any, output: Any) -> None:
            state = self.latched(context)
            output[0] = T(0.0)
            if state[PHASE] == CONTACT:
                motion = self._motion(context, round(value_of(state[POINT])))
                p, _ = self._relative(*motion)
                output[0] = stored_energy(-p[2], state[KB], state[HB])

        def _calc_power(self, context: Any, output: Any) -> None:
            state = context.get_discrete_state_vector().CopyToVector()
            if state[PHASE] != CONTACT:
                output.SetFromVector(self._no_power)
            elif self.discrete:
                output.SetFromVector(self._power_of_step(context, state))
            else:
                motion, law = self._contact_law(context, state)
                output.SetFromVector(self._powers(motion, law, state))

        def _powers(self, motion: Any, law: Any, state: Any) -> Any:
            """The output `power`, from a motion and what the law says of it."""
            on_ball, _, p, v, force = law
            w = motion[2][:3] @ motion[0][:, :3]
            damping = state[CB] - state[DB] * p[2]
            lost_ball, lost_friction, couple = contact_powers(p, v, force, damping, w)
            if state[AT_BALL] > 0.5:
                couple = 0.0 * couple
            return np.array([lost_ball, lost_friction, couple, *on_ball[3:]])

        def _acting(self, motion: Any, law: Any, state: Any) -> None:
            """Keeps what acts over a discrete step, and the head's spin where it begins."""
            on_ball, _, p, v, force = law
            w = motion[2][:3] @ motion[0][:, :3]
            damping = state[CB] - state[DB] * p[2]
            damper = damping * v[2] if force[2] > 0.0 else 0.0 * v[2]
            couple = (0.0 if state[AT_BALL] > 0.5 else 1.0) * np.cross(p, force[:3])
            acting = np.array([damper, *force[:2], *couple, *on_ball[3:]])
            state[ACTING], state[SPIN] = state[WEIGHT] * acting, w

        def _power_of_step(self, context: Any, state: Any) -> Any:
            """The output `power` of a discrete step: what acts, at its mean velocities.

            Once the updates of its instant are done, the plant has the velocities of its end.
            """
            motion = self._motion(context, round(value_of(state[POINT])))
            v = 0.5 * (state[RATE] + np.array(self._relative(*motion)[1]))
            w = 0.5 * (state[SPIN] + motion[2][:3] @ motion[0][:, :3])
            damper, fx, fy, *rest = state[ACTING]
            couple = w[0] * rest[0] + w[1] * rest[1] + w[2] * rest[2]
            return np.array([damper * v[2], -fx * v[0] - fy * v[1], couple, *rest[3:]])

        # ---- touch, release, leaving

        def _declare_events(self) -> None:
            self.DeclareInitializationUnrestrictedUpdateEvent(self._update)
            if self.discrete:
                # not at every step of a Simulator, which may be shorter than the plant's
                step = self.plant.time_step()
                self.DeclarePeriodicUnrestrictedUpdateEvent(step, 0.0, self._update)
                return
            event = UnrestrictedUpdateEvent_[T](system_callback=_dispatch_update)
            falling = WitnessFunctionDirection.kPositiveThenNonPositive
            self._witnesses = {
                FREE: self.MakeWitnessFunction("touch", falling, self._gap, event),
                CONTACT: self.MakeWitnessFunction("release", falling, self._raw_normal, event),
                PASSED: self.MakeWitnessFunction("leaving", falling, self._compression, event),
            }

        def DoGetWitnessFunctions(self, context: Any) -> list[Any]:
            if self.discrete:
                return []
            return [self._witnesses[value_of(context.get_discrete_state_vector()[PHASE])]]

        def _next_point(self, context: Any) -> Any:
            """The point to be hit (given, or nearest now), with p and v of the ball about it."""
            self._look(context)
            given = point = round(value_of(context.get_numeric_parameter(self.CHOICES)[0]))
            if self._next is not None and self._next[0] == given:
                return self._next[1]
            if point == 0:
                p, _ = self._relative(*self._motion(context, self._middle))
                x, y = self.model.grid[self._middle - 1]
                point = nearest_point(self.model.grid, x + value_of(p[0]), y + value_of(p[1]))
            found = point, *self._relative(*self._motion(context, point))
            self._next = given, found
            return found

        def _gap(self, context: Any) -> Any:
            return self._next_point(context)[1][2]

        def _compression(self, context: Any) -> Any:
            return -self._gap(context)

        def _raw_normal(self, context: Any) -> Any:
            state = context.get_discrete_state_vector().CopyToVector()
            return self._contact_law(context, state)[1][4][3]

        def _update(self, context: Any, new: Any) -> EventStatus:
            """Goes to the phase that the present state asks for."""
            record = context.get_discrete_state_vector().CopyToVector()
            if not self._advance(context, record):
                return EventStatus.DidNothing()
            numbers = [x if isinstance(x, T) else T(x) for x in record]
            new.get_mutable_discrete_state().get_mutable_vector().SetFromVector(np.array(numbers))
            return EventStatus.Succeeded()

        def _advance(self, context: Any, record: Any) -> bool:
            """Takes the record to this instant; False if that changes nothing in it."""
            phase = value_of(record[PHASE])
            if phase == CONTACT:
                if self.discrete and self._since_update(context, record) == 0.0:
                    return False  # a run that starts at touch: the first update is of that instant
                coming = self._after_contact(context, record)
            else:
                point, p, v = self._next_point(context)
                inside = phase == FREE and inside_rim(self.model.grid, self.model.rim, point, p)
                coming = next_phase(phase, p[2], v[2], 0.0, inside)
                if coming == CONTACT:
                    self._touch(context, record, point, p, v)
                else:
                    record[PHASE] = coming
            if self.discrete:
                record[SEEN] = context.get_time()
            return bool(self.discrete or coming != phase)

        def _after_contact(self, context: Any, record: Any) -> Any:
            """The phase after this instant in contact; on a discrete plant, at a step's start."""
            motion = self._motion(context, round(value_of(record[POINT])))
            p, v = self._relative(*motion)
            if self.discrete:
                lead = 0.5 * (np.array(v) - record[RATE])
                motion = self._led(motion, lead)
            law = self._law(*motion, record[CONSTANTS])
            coming = next_phase(CONTACT, p[2], v[2], law[4][3], True)
            if coming != CONTACT:
                release(record, p, context.get_time())
                if self.discrete:
                    late_release(record, p, v, self.plant.time_step())
            elif self.discrete:
                record[WEIGHT], record[RATE], record[LEAD] = 1.0, v, lead
                self._acting(motion, law, record)
            return coming

        def _touch(self, context: Any, record: Any, point: int, p: Any, v: Any) -> None:
            parameters = [
                context.get_numeric_parameter(i).CopyToVector()
                for i in (self.BALL, self.FRICTION, self.SCALES, self.CHOICES)
            ]
            touch(record, point, p, v, context.get_time(), *parameters)
            if self.discrete:
                late_touch(record, p, v, self.plant.time_step())
                motion = self._motion(context, point)
                self._acting(motion, self._law(*motion, record[CONSTANTS]), record)

    return Impl


BallContact = on_float(BallContact_)
"""`BallContact` is `BallContact_` on plain numbers: the contact of ball and strings."""


def _dispatch_update(system: Any, context: Any, event: Any, state: Any) -> Any:
    return system._update(context, state)
