"""Where the parts of an upper limb are in a posture, as labelled data, and its table of numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.framework import Context

from drake_racket import SEGMENTS, InputError, Limb, UpperLimbParameters

if TYPE_CHECKING:
    import xarray

FRAMES = ("shoulder", "elbow", "wrist", "knuckle", "hand")
_XYZ = ["x", "y", "z"]


def set_posture(limb: Limb, plant_context: Context, posture: NDArray[np.float64]) -> None:
    """Writes the joints' positions (rad), (7,), in the limb's order into the plant's Context.

    Raises:
        InputError: not one finite number for each joint.

    """
    posture = np.asarray(posture, dtype=float)
    if posture.shape != (len(limb.joints),) or not np.all(np.isfinite(posture)):
        raise InputError("posture", posture.tolist(), f"{len(limb.joints)} finite numbers (rad)")
    q = limb.plant.GetPositions(plant_context).copy()
    q[limb.position_indices()] = posture
    limb.plant.SetPositions(plant_context, q)


def limb_posture(limb: Limb, plant_context: Context) -> xarray.Dataset:
    """Frames and joint axes of an upper limb in the world, from the plant's kinematics.

    Returns:
        Dataset over frame (shoulder, elbow, wrist, knuckle, hand), joint, axis (x, y, z of the
        world) and direction (x, y, z of a frame): `frame_origin` (frame, axis), `frame_axes`
        (frame, axis, direction), `joint_centre` and `joint_axis` (joint, axis), whose right-hand
        rotation is positive, `joint_position`, `joint_lower`, `joint_upper` (joint).

    """
    import xarray

    plant = limb.plant
    (instance,) = limb.model_instances
    poses = [plant.GetFrameByName(f, instance).CalcPoseInWorld(plant_context) for f in FRAMES]
    centres, axes = [], []
    for joint in limb.joints:
        X_WF = joint.frame_on_parent().CalcPoseInWorld(plant_context)
        centres.append(X_WF.translation())
        axes.append(X_WF.rotation().multiply(joint.revolute_axis()))
    limits = [(j.position_lower_limits()[0], j.position_upper_limits()[0]) for j in limb.joints]
    q = plant.GetPositions(plant_context)[limb.position_indices()]
    at = ("joint", "axis")
    return xarray.Dataset(
        {
            "frame_origin": (
                ("frame", "axis"),
                np.array([pose.translation() for pose in poses]),
                {"units": "m", "long_name": "origin of the frame in the world"},
            ),
            "frame_axes": (
                ("frame", "axis", "direction"),
                np.array([pose.rotation().matrix() for pose in poses]),
                {"units": "1", "long_name": "rotation matrix of the frame in the world"},
            ),
            "joint_centre": (at, np.array(centres), {"units": "m", "long_name": "joint's centre"}),
            "joint_axis": (at, np.array(axes), {"units": "1", "long_name": "axis of rotation"}),
            "joint_position": ("joint", q, {"units": "rad", "long_name": "position"}),
            "joint_lower": (
                "joint",
                np.array([low for low, _ in limits]),
                {"units": "rad", "long_name": "lower end of the range of motion"},
            ),
            "joint_upper": (
                "joint",
                np.array([high for _, high in limits]),
                {"units": "rad", "long_name": "upper end of the range of motion"},
            ),
        },
        coords={
            "frame": ("frame", list(FRAMES), {"units": "1", "long_name": "named frame"}),
            "joint": ("joint", limb.joint_names(), {"units": "1", "long_name": "joint"}),
            "axis": ("axis", _XYZ, {"units": "1", "long_name": "axis of the world"}),
            "direction": ("direction", _XYZ, {"units": "1", "long_name": "axis of the frame"}),
        },
    )


def segment_dataset(limb: UpperLimbParameters) -> xarray.Dataset:
    """Mass, length, centre of mass and moments of inertia of the three segments."""
    import xarray

    names = (
        ("mass", "kg", "mass", limb.mass),
        ("length", "m", "length", lambda s: limb.segment(s).length.value),
        ("com", "m", "centre of mass from the proximal joint", limb.com),
        ("moi_sagittal", "kg m^2", "moment of inertia, sagittal", lambda s: limb.moments(s)[0]),
        ("moi_transverse", "kg m^2", "moment of inertia, transverse", lambda s: limb.moments(s)[1]),
        (
            "moi_longitudinal",
            "kg m^2",
            "moment of inertia, longitudinal",
            lambda s: limb.moments(s)[2],
        ),
    )
    return xarray.Dataset(
        {
            name: ("segment", np.array([f(s) for s in SEGMENTS]), {"units": u, "long_name": text})
            for name, u, text, f in names
        },
        coords={"segment": ("segment", list(SEGMENTS), {"units": "1", "long_name": "segment"})},
        attrs={"limb": limb.name, "subject_mass_kg": limb.subject.mass.value},
    )
