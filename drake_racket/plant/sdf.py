"""Writes the SDF of a racket and of a ball from their parameter files.

The files under sdf/ are this module's output for the shipped parameters (`make sdf` writes them
again; a test compares), and `add_racket` parses the same
text, so that the numbers in SDF and YAML are one.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from pydrake.math import RotationMatrix
from pydrake.multibody.tree import RotationalInertia, SpatialInertia

from drake_racket.parameters.ball import BallParameters, surface_of
from drake_racket.parameters.frame import (
    AXES,
    FrameJoint,
    FrameSegment,
    bushing_constants,
)
from drake_racket.parameters.racket import RacketParameters
from drake_racket.parameters.segments import segment_at


@dataclass(frozen=True)
class LinkInertia:
    """Says what SDF says of a link's inertia; `spatial` is the same for a Context.

    mass (kg); com (m), the centre of mass along the link's x; moments (kg m^2) about it, along x, y
    and z; com_y (m) and product (kg m^2), I_xy about it, of what is not alike on both sides.
    """

    mass: float
    com: float
    moments: tuple[float, float, float]
    com_y: float = 0.0
    product: float = 0.0

    def spatial(self) -> SpatialInertia:
        """Gives M_LLo_L as Drake's parser makes it of the SDF, to the last bit.

        Raises:
            RuntimeError: Drake does not take it for a body's inertia.

        """
        moments = RotationalInertia(*self.moments, self.product, 0.0, 0.0)
        return SpatialInertia.MakeFromCentralInertia(
            self.mass, [self.com, self.com_y, 0.0], moments.ReExpress(RotationMatrix())
        )


def segment_inertia(segment: FrameSegment) -> LinkInertia:
    """Gives the inertia of one segment of the frame."""
    return LinkInertia(segment.mass, segment.com, segment.moments, segment.com_y, segment.product)


def string_inertia(racket: RacketParameters) -> LinkInertia:
    """Gives the inertia of one of the string masses."""
    return LinkInertia(racket.string_mass(), 0.0, (0.0, 0.0, 0.0))


def ball_inertia(ball: BallParameters, contact: str = "paper") -> LinkInertia:
    """Gives the inertia of the ball; with contact paper, where nothing turns it, a thin shell's."""
    mass, radius = ball.mass.value, ball.radius.value
    factor = surface_of(ball).inertia_factor.value if contact == "surface" else 2.0 / 3.0
    moment = factor * mass * radius * radius
    return LinkInertia(mass, 0.0, (moment, moment, moment))


_OPEN = '<?xml version="1.0"?>\n<sdf xmlns:drake="drake.mit.edu" version="1.9">\n'


def racket_sdf(racket: RacketParameters, name: str | None = None, *, strung: bool = True) -> str:
    """Writes the SDF text of one racket, with string masses if `strung`.

    The joints are those of `RacketParameters.frame_joints`, with massless links between those at
    one place. Two segments have the published spring-dampers, in one bushing; more have theirs on
    the joints.

    The model frame is R (butt, x to the tip, z normal to the strings). Link `handle` has its origin
    at the butt, link `head`, which carries the string-bed's centre, at the throat joint, the others
    where they begin; all axes agree in the rest pose.
    """
    throat = racket.handle.length.value
    segments, joints = racket.frame_segments(), racket.frame_joints()
    paired = len(segments) == 2
    links, chain = _frame_chain(segments, joints, sprung=not paired)
    lines = [
        f'  <model name="{name or racket.name}">',
        *_segment_link(segments[0]),
        *links,
        *chain,
        *_frame("butt", "handle", 0.0),
        *_frame("grip", "handle", racket.landmarks.grip.value),
        *_frame_at(segments, "accelerometer", racket.landmarks.accelerometer.value),
        *(_frame("throat", "head", 0.0) if paired else _frame_at(segments, "throat", throat)),
        *(_frame("throat_handle", "handle", throat) if paired else []),
        *_frame("gsc", "head", racket.string_bed.gsc.value),
        *_tip(racket),
        *(_throat_bushing(joints) if paired else []),
    ]
    if strung:
        lines += _string_masses(racket)
    return _OPEN + "\n".join([*lines, "  </model>", "</sdf>", ""])


def _tip(racket: RacketParameters) -> list[str]:
    """The frame at the tip, on the last segment."""
    last = racket.frame_segments()[-1]
    if last.name == "head":
        return _frame("tip", "head", racket.head.length.value)
    return _frame("tip", last.name, last.end - last.origin)


def _frame_at(segments: Sequence[FrameSegment], name: str, place: float) -> list[str]:
    """A frame at a place from the butt, on the segment that holds it."""
    segment = segments[0] if place <= segments[0].end else segments[segment_at(segments, place)]
    return _frame(name, segment.name, place - segment.origin)


def _throat_bushing(joints: Sequence[FrameJoint]) -> list[str]:
    stiffness, damping = bushing_constants(joints)
    return [
        "    <drake:linear_bushing_rpy>",
        "      <drake:bushing_frameA>throat_handle</drake:bushing_frameA>",
        "      <drake:bushing_frameC>throat</drake:bushing_frameC>",
        "      <!-- roll, pitch (out-of-plane bending), yaw (in-plane bending) -->",
        _bushing("torque_stiffness", stiffness),
        _bushing("torque_damping", damping),
        _bushing("force_stiffness", (0.0, 0.0, 0.0)),
        _bushing("force_damping", (0.0, 0.0, 0.0)),
        "    </drake:linear_bushing_rpy>",
    ]


def ball_sdf(ball: BallParameters, name: str | None = None, contact: str = "paper") -> str:
    """Gives SDF text of the ball: one free body.

    With contact paper the force goes through its centre: it moves as a point mass, and keeps what
    spin it is given. Drake needs a rotational inertia; a thin shell's, 2/3 m r^2, is given then.
    """
    body = [
        f'  <model name="{name or ball.name}">',
        '    <link name="ball">',
        *_inertial(ball_inertia(ball, contact)),
        "    </link>",
        "  </model>",
        "</sdf>",
        "",
    ]
    return _OPEN + "\n".join(body)


def _string_masses(racket: RacketParameters) -> list[str]:
    inertia = string_inertia(racket)
    points = racket.bed_topology().points
    span = f"{points[0]}-{points[-1]}"
    lines = [
        f"    <!-- string-bed points {span}, each free along the normal of the string plane -->"
    ]
    for i in points:
        x, y = racket.point_in_head(i)
        pose = f"{x!r} {y!r} 0 0 0 0"
        lines += [
            f'    <link name="string_{i}">',
            f'      <pose relative_to="head">{pose}</pose>',
            *_inertial(inertia),
            "    </link>",
            *_joint(f"string_joint_{i}", "prismatic", "head", f"string_{i}", "0 0 1"),
        ]
    return lines


def _segment_link(segment: FrameSegment) -> list[str]:
    pose = f'      <pose relative_to="handle">{segment.origin!r} 0 0 0 0 0</pose>'
    return [
        f'    <link name="{segment.name}">',
        *([pose] if segment.name != "handle" else []),
        *_inertial(segment_inertia(segment)),
        "    </link>",
    ]


def _massless_link(name: str, parent: str, x: float) -> list[str]:
    return [
        f'    <link name="{name}">',
        f'      <pose relative_to="{parent}">{x!r} 0 0 0 0 0</pose>',
        *_inertial(LinkInertia(0.0, 0.0, (0.0, 0.0, 0.0))),
        "    </link>",
    ]


def _inertial(inertia: LinkInertia) -> list[str]:
    """Every element of the inertia is written: a missing one would silently become 1 kg m^2."""
    ixx, iyy, izz = inertia.moments
    return [
        "      <inertial>",
        f"        <pose>{inertia.com!r} {_number(inertia.com_y)} 0 0 0 0</pose>",
        f"        <mass>{inertia.mass!r}</mass>",
        f"        <inertia><ixx>{ixx!r}</ixx><iyy>{iyy!r}</iyy><izz>{izz!r}</izz>"
        f"<ixy>{_number(inertia.product)}</ixy><ixz>0</ixz><iyz>0</iyz></inertia>",
        "      </inertial>",
    ]


def _joint(
    name: str, kind: str, parent: str, child: str, axis: str, place: str = "", spring: str = ""
) -> list[str]:
    """An effort limit of 0 keeps Drake from adding an actuator."""
    return [
        f'    <joint name="{name}" type="{kind}">',
        *([place] if place else []),
        f"      <parent>{parent}</parent>",
        f"      <child>{child}</child>",
        f"      <axis><xyz>{axis}</xyz>{spring}<limit><effort>0</effort></limit></axis>",
        "    </joint>",
    ]


def _frame(name: str, link: str, x: float) -> list[str]:
    return [
        f'    <frame name="{name}" attached_to="{link}">',
        f'      <pose relative_to="{link}">{x!r} 0 0 0 0 0</pose>',
        "    </frame>",
    ]


def _frame_chain(
    segments: Sequence[FrameSegment], joints: Sequence[FrameJoint], *, sprung: bool
) -> tuple[list[str], list[str]]:
    """The links beyond the first segment, massless ones between joints, and the joints."""
    links: list[str] = []
    chain: list[str] = []
    for inner, (parent, child) in enumerate(itertools.pairwise(segments)):
        own = [joint for joint in joints if joint.inner == inner]
        first = "throat_link" if not sprung else f"link_{inner + 1}"
        names = [first, f"{first}_2"][: len(own) - 1]
        bodies = [parent.name, *names, child.name]
        order = ", then ".join(f"about {joint.axis}" for joint in own)
        if names:
            links.append(f"    <!-- massless, between the revolute joints: first {order} -->")
        for joint, outer, name in zip(own, bodies, bodies[1:], strict=False):
            axis = " ".join(str(int(joint.axis == axis)) for axis in AXES)
            chain += _joint(joint.name, "revolute", outer, name, axis, *_spring(joint, sprung))
            if name != child.name:
                at = ("handle", joint.place) if outer == parent.name else (outer, 0.0)
                links += _massless_link(name, *at)
        links += _segment_link(child)
    return links, chain


def _spring(joint: FrameJoint, sprung: bool) -> tuple[str, str]:
    """Where a joint is, and its spring-damper; nothing for a joint of the published frame."""
    if not sprung:
        return "", ""
    dynamics = (
        f"<dynamics><damping>{joint.damping!r}</damping>"
        f"<spring_stiffness>{joint.stiffness!r}</spring_stiffness></dynamics>"
    )
    return f'      <pose relative_to="handle">{joint.place!r} 0 0 0 0 0</pose>', dynamics


def _bushing(name: str, values: Sequence[float]) -> str:
    text = " ".join(map(_number, values))
    return f"      <drake:bushing_{name}>{text}</drake:bushing_{name}>"


def _number(value: float) -> str:
    return repr(value) if value else "0"
