"""Runs the hammer's rig in the compiled engine: the same steps, the same law, less time."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame
from pydrake.systems.framework import Context

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.engines.compiled.dynamics.observe import NODE_ROW
from drake_racket.engines.compiled.extract.model import Strike, Wiring, extract
from drake_racket.engines.compiled.integrate import FINISHED
from drake_racket.engines.compiled.kernel import run_case, see_motion
from drake_racket.engines.trajectory import cross
from drake_racket.io.errors import SimulationError
from drake_racket.laws.phases import SIZE

Array = NDArray[np.float64]


class StruckPlant:
    """A StruckPlant is the model of a plant that one hammer strikes, from one Context.

    Args:
        plant: finalized, with nothing on its ports but the hammer.
        hammer: the HammerForce.
        sensor: frame whose acceleration is read.
        root: of the Diagram: parameters and state at the start of the pulse are its.

    """

    def __init__(self, plant: MultibodyPlant, hammer: Any, sensor: Frame, root: Context) -> None:
        own = hammer.GetMyContextFromRoot(root)
        numbers, place, direction = (
            own.get_numeric_parameter(i).CopyToVector()
            for i in (hammer.PULSE, hammer.PLACE, hammer.DIRECTION)
        )
        strike = Strike(hammer.body, place, direction, hammer.sampled, numbers)
        model = extract(plant, root, Wiring(strike=strike))
        self._ints, self._floats = model.ints, model.floats
        self._tables = at.open_model(model.ints, model.floats)
        self._state = plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(root))
        node, X_NB = model.tree.place[int(sensor.body().index())]
        self._node, self._X_NS = node, X_NB @ sensor.GetFixedPoseInBodyFrame()

    def states(self, stops: Array, step: float) -> Array:
        """Gives the states [q; v] at rising times (s), by steps of Dormand and Prince.

        Args:
            stops: (n,) of the pulse's own time, from its start on; a step ends at each.
            step: s, at most.

        Raises:
            SimulationError: the state is not finite.

        """
        y, found = self._state.copy(), np.empty((len(stops), len(self._state)))
        records, none = np.zeros((0, SIZE)), np.zeros((0, 0, SIZE))
        nothing, weights = np.zeros((0, 1 + len(y))), np.ones(len(y))
        found[0] = y
        for i in range(1, len(stops)):
            self._floats[at.BEGIN] = stops[i - 1]
            length = stops[i] - stops[i - 1]
            even = length / np.ceil(length / step * (1.0 - 1e-12))  # steps of one length
            *_, how = run_case(
                self._tables, y, records, length, 1.0, even, False, weights, nothing, none
            )
            if how != FINISHED:
                raise SimulationError(f"stopped at t = {stops[i]:.6g} s: the state is not finite")
            found[i] = y
        return found

    def sensed(self, times: Array, states: Array) -> Array:
        """Gives the acceleration (n, 3) of the sensor, in its own axes (m/s^2)."""
        self._floats[at.BEGIN] = 0.0
        n, ints = len(states), self._ints
        nodes, loads = np.zeros((n, ints[at.NODES], NODE_ROW)), np.zeros((n, 6))
        records, leaves = np.zeros((n, 0, SIZE)), np.zeros((n, 0, 6))
        tables = at.one_by_one(self._tables)
        see_motion(tables, times, states, records, nodes, leaves, loads)
        row = nodes[:, self._node]
        rotation = row[:, :9].reshape(n, 3, 3)
        arm = rotation @ self._X_NS.translation()
        w, alpha = row[:, 12:15], row[:, 18:21]
        a = row[:, 21:24] + cross(alpha, arm) + cross(w, cross(w, arm))
        turned = rotation @ self._X_NS.rotation().matrix()
        return np.asarray(np.einsum("nji,nj->ni", turned, a))
