"""Writes the SDF of a racket and of a ball from their parameter files.

The files under sdf/ are this module's output for the shipped parameters (`make sdf` writes them
again; a test compares), and `add_racket` parses the same
text, so that the numbers in SDF and YAML are one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pydrake.math import RotationMatrix
from pydrake.multibody.tree import RotationalInertia, SpatialInertia

from drake_racket.parameters.ball import BallParameters, surface_of
from drake_racket.parameters.frame import AXES, FrameJoint, bushing_constants
from drake_racket.parameters.racket import Part, RacketParameters


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


def part_inertia(part: Part) -> LinkInertia:
    """Gives the inertia of the handle or the head."""
    x, y = part.centre()
    return LinkInertia(part.mass.value, x, part.moments(), y, part.product())


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

    The joints are those of `RacketParameters.frame_joints`, with massless links between them.

    The model frame is R (butt, x to the tip, z normal to the strings). Links `handle` and `head`
    have their origins at the butt and at the throat joint; all axes agree in the rest pose.
    """
    throat = racket.handle.length.value
    bed = racket.string_bed
    joints = racket.frame_joints()
    stiffness, damping = bushing_constants(joints)
    pose = f'      <pose relative_to="handle">{throat!r} 0 0 0 0 0</pose>'
    links, chain = _frame_chain(joints)
    lines = [
        f'  <model name="{name or racket.name}">',
        *_link("handle", racket.handle),
        *links,
        *_link("head", racket.head, pose),
        *chain,
        *_frame("butt", "handle", 0.0),
        *_frame("grip", "handle", racket.landmarks.grip.value),
        *_frame("accelerometer", "handle", racket.landmarks.accelerometer.value),
        *_frame("throat", "head", 0.0),
        *_frame("throat_handle", "handle", throat),
        *_frame("gsc", "head", bed.gsc.value),
        *_frame("tip", "head", racket.head.length.value),
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
    if strung:
        lines += _string_masses(racket)
    return _OPEN + "\n".join([*lines, "  </model>", "</sdf>", ""])


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


def _link(name: str, part: Part, pose: str | None = None) -> list[str]:
    return [
        f'    <link name="{name}">',
        *([pose] if pose else []),
        *_inertial(part_inertia(part)),
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


def _joint(name: str, kind: str, parent: str, child: str, axis: str) -> list[str]:
    """An effort limit of 0 keeps Drake from adding an actuator."""
    return [
        f'    <joint name="{name}" type="{kind}">',
        f"      <parent>{parent}</parent>",
        f"      <child>{child}</child>",
        f"      <axis><xyz>{axis}</xyz><limit><effort>0</effort></limit></axis>",
        "    </joint>",
    ]


def _frame(name: str, link: str, x: float) -> list[str]:
    return [
        f'    <frame name="{name}" attached_to="{link}">',
        f'      <pose relative_to="{link}">{x!r} 0 0 0 0 0</pose>',
        "    </frame>",
    ]


def _frame_chain(joints: Sequence[FrameJoint]) -> tuple[list[str], list[str]]:
    """The massless links between the joints from handle to head, and the joints."""
    names = ["throat_link", "throat_link_2"][: len(joints) - 1]
    bodies = ["handle", *names, "head"]
    order = ", then ".join(f"about {joint.axis}" for joint in joints)
    links = [f"    <!-- massless, between the revolute joints: first {order} -->"] if names else []
    chain: list[str] = []
    for joint, parent, child in zip(joints, bodies, bodies[1:], strict=False):
        axis = " ".join(str(int(joint.axis == axis)) for axis in AXES)
        chain += _joint(joint.name, "revolute", parent, child, axis)
        if child != "head":
            place = joint.place if parent == "handle" else 0.0
            links += _massless_link(child, parent, place)
    return links, chain


def _bushing(name: str, values: Sequence[float]) -> str:
    text = " ".join(map(_number, values))
    return f"      <drake:bushing_{name}>{text}</drake:bushing_{name}>"


def _number(value: float) -> str:
    return repr(value) if value else "0"
