"""Small arms as text: what real files look like, without their size."""

from __future__ import annotations

from pathlib import Path

from drake_racket import LimbSettings, Scenario, Stroke


def link(name: str, mass: float = 1.0, com: str = "0.15 0 0", moment: float = 0.01) -> str:
    if mass == 0.0:
        return f'<link name="{name}"/>'
    m = f'ixx="{moment}" iyy="{moment}" izz="{moment}" ixy="0" ixz="0" iyz="0"'
    return (
        f'<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>'
        f"<inertia {m}/></inertial></link>"
    )


def joint(
    name: str,
    parent: str,
    child: str,
    *,
    kind: str = "revolute",
    axis: str = "0 1 0",
    at: str = "0.3 0 0",
    limit: str = 'lower="-2" upper="2" effort="300" velocity="40"',
    more: str = "",
) -> str:
    limits = "" if kind == "fixed" else f'<axis xyz="{axis}"/><limit {limit}/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{at}"/>{limits}{more}</joint>'
    )


def robot(*parts: str) -> str:
    return '<robot name="r">' + "".join(parts) + "</robot>"


def arm(side: str, y: float) -> list[str]:
    """Two joints and a massless hand that a fixed joint holds."""
    return [
        link(f"{side}_upper", 2.0),
        link(f"{side}_fore", 1.5),
        link(f"{side}_hand", 0.0),
        joint(f"{side}_shoulder", "chest", f"{side}_upper", at=f"0 {y} 0.3"),
        joint(f"{side}_elbow", f"{side}_upper", f"{side}_fore"),
        joint(f"{side}_grip", f"{side}_fore", f"{side}_hand", kind="fixed"),
    ]


HEAD = [
    link("head", 4.0, com="0 0 0.1"),
    joint(
        "neck",
        "chest",
        "head",
        at="0 0 0.5",
        more='<dynamics damping="0.4"/>',
    ),
]
TRUNK = [
    link("pelvis", 0.0),
    link("chest", 20.0, com="0 0 0.2", moment=0.5),
    joint("waist", "pelvis", "chest", axis="0 0 1", at="0 0 0"),
]
HUMANOID = robot(*TRUNK, *arm("right", -0.2), *arm("left", 0.2), *HEAD)


def striking(model: Path, hand: str, **changes: object) -> Scenario:
    """A slow stroke of that arm, in a weld, for 2 ms."""
    own: dict[str, object] = {
        "model": str(model),
        "hand": hand,
        "base": "pelvis",
        "stroke": Stroke(speed=4.0, velocity_elevation_deg=90.0),
    }
    limb = {key: changes.pop(key) for key in list(changes) if key in LimbSettings.__annotations__}
    settings = LimbSettings(**(own | limb))  # type: ignore[arg-type]
    case = {"grip_kind": "weld", "speed": 20.0, "after": 0.002} | changes
    return Scenario(support="limb", limb=settings, **case)  # type: ignore[arg-type]
