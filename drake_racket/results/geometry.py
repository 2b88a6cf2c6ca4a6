"""What a history carries so that a picture can be made from it alone: poses and lengths.

`history.make_history` calls this module; `scene` reads what it leaves.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.tree import Frame, RigidBody
from pydrake.systems.framework import Context

from drake_racket.limbs.limb import Limb

if TYPE_CHECKING:
    from drake_racket.cases.diagram import ImpactDiagram
    from drake_racket.simulation import Run

Row = tuple[str, str | None, str, str, str]
"""Of a history's variable: name, dimension beside time, units, frame, text."""

_SAME_PLACE = 1e-6  # m; joints nearer than this, at both ends of a run, are one landmark


def handle_rows(frame: str) -> tuple[Row, ...]:
    """The variable that every history carries; `frame` is what the world's is called."""
    return (("handle_quaternion", "quaternion", "1", frame, "orientation of the handle's axes"),)


def landmark_rows(frame: str) -> tuple[Row, ...]:
    """The variables of a history with landmarks: hand and limb."""
    text = "place of the hand's and the limb's landmarks along"
    return tuple((f"landmark_{a}", "landmark", "m", frame, f"{text} {a}") for a in "xyz")


class LoggedGeometry:
    """The handle's orientation and the places of hand and limb, sample by sample.

    With the butt's position and the throat joint's angles, which a history has anyway, the
    orientation gives every body of the racket.

    Attributes:
        landmarks: names, from the trunk to the hand: each place of the limb's joints under the
            name of its first joint, then `hand`; `hand` alone for a hand without a limb; none for
            a racket that no hand holds.
        segments: pairs of landmarks with a segment of the limb between them.

    """

    def __init__(self, run: Run) -> None:
        self._system = run.system
        self.landmarks: list[str] = []
        self.segments: list[tuple[str, str]] = []
        self._frames: list[Frame] = []
        if run.system.limb is not None:
            self._add_limb(run, run.system.limb.limb)
        elif run.system.grip is not None:
            self._add("hand", run.system.grip.hand_frame)

    def sample(self, context: Context) -> dict[str, Any]:
        """The variables at one state of the plant (a plant Context)."""
        rotation = self._system.impact.racket.handle.EvalPoseInWorld(context).rotation()
        sample: dict[str, Any] = {"handle_quaternion": rotation.ToQuaternion().wxyz()}
        if self.landmarks:
            places = np.array([f.CalcPoseInWorld(context).translation() for f in self._frames])
            sample |= {f"landmark_{axis}": places[:, i] for i, axis in enumerate("xyz")}
        return sample

    def coordinates(self) -> dict[str, list[str]]:
        """The labels of the dimensions that the variables add."""
        labels = {"quaternion": ["w", "x", "y", "z"]}
        return labels | ({"landmark": self.landmarks} if self.landmarks else {})

    def attribute(self) -> str:
        """The lengths (m) of racket and ball, and the limb's segments, as JSON."""
        return json.dumps(lengths(self._system) | {"segments": self.segments})

    def _add(self, name: str, frame: Frame) -> None:
        self.landmarks.append(name)
        self._frames.append(frame)

    def _add_limb(self, run: Run, limb: Limb) -> None:
        """Joints in one place become one landmark; a segment joins each to its parent's."""
        plant = run.system.plant
        joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
        inward = {int(joint.child_body().index()): joint.parent_body() for joint in joints}
        frames = [joint.frame_on_child() for joint in limb.joints] + [limb.hand]
        ends = [_places(run, frames, index) for index in (0, len(run.time) - 1)]
        row_of: dict[str, int] = {}  # landmark -> row of its frame
        landmark_of: dict[int, str] = {}  # body -> landmark of the joint that carries it
        for row, joint in enumerate(limb.joints):
            parent = _carrier(landmark_of, inward, joint.parent_body())
            name = joint.name()
            if parent is not None and all(
                float(np.linalg.norm(p[row] - p[row_of[parent]])) < _SAME_PLACE for p in ends
            ):
                name = parent
            else:
                row_of[name] = row
                self._add(name, frames[row])
                if parent is not None:
                    self.segments.append((parent, name))
            landmark_of[int(joint.child_body().index())] = name
        parent = _carrier(landmark_of, inward, limb.hand.body())
        self._add("hand" if "hand" not in self.landmarks else "hand_frame", limb.hand)
        if parent is not None:
            self.segments.append((parent, self.landmarks[-1]))


def lengths(system: ImpactDiagram) -> dict[str, float]:
    """Lengths (m) that a drawing of racket and ball needs."""
    racket, ball = system.impact.racket.parameters, system.impact.ball
    assert ball is not None
    bed = racket.string_bed
    return {
        "handle_length": racket.handle.length.value,
        "head_length": racket.head.length.value,
        "gsc": bed.gsc.value,
        "spacing": bed.spacing.value,
        "rim_semi_axis_x": bed.rim_semi_axis_x.value,
        "rim_semi_axis_y": bed.rim_semi_axis_y.value,
        "ball_radius": ball.parameters.radius.value,
    }


def _places(run: Run, frames: list[Frame], index: int) -> NDArray[np.float64]:
    context = run.system.plant.GetMyContextFromRoot(run.context_at(index))
    return np.array([frame.CalcPoseInWorld(context).translation() for frame in frames])


def _carrier(
    landmark_of: dict[int, str], inward: dict[int, RigidBody], body: RigidBody
) -> str | None:
    """The landmark of the nearest joint of the limb between `body` and the world."""
    while int(body.index()) not in landmark_of:
        if int(body.index()) not in inward:
            return None
        body = inward[int(body.index())]
    return landmark_of[int(body.index())]
