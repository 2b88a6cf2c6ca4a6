"""An imported limb beside MuJoCo itself: poses, mass matrix, gravity and bias forces.

Both are asked for the same numbers at random positions and velocities. Where joints are locked,
MuJoCo's are those of its other degrees of freedom, with the locked ones still.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context

from drake_racket.limbs import (
    ImportedLimb,
    import_mujoco,
    load_model,
    mujoco_package,
    pose,
    quiet_mujoco,
)

FREE_RANGE = {"hinge": np.pi, "slide": 0.5}  # a joint without limits goes to plus and minus this

_ERRORS = {
    "position_error": ("m", "Largest distance between a body's origins"),
    "rotation_error": ("rad", "Largest angle between a body's orientations"),
    "mass_matrix_error": ("1", "Largest |dM_ij| / sqrt(M_ii M_jj)"),
    "gravity_error": ("1", "Largest gravity force error, by the largest gravity force"),
    "bias_error": ("1", "Largest bias force error, by the largest bias force"),
}


def compare_with_mujoco(
    model: Any,
    *,
    samples: int = 100,
    speed: float = 5.0,
    seed: int = 0,
    **options: Any,
) -> xarray.Dataset:
    """Imports a model into a plant of its own and compares the two at random states.

    Args:
        samples: how many states; joints anywhere within their ranges.
        speed: largest joint velocity, rad/s or m/s.
        seed: of the random numbers.
        options: of `import_mujoco` (root, hand, couplings, locked, reference).

    Returns:
        `position_error` (m), `rotation_error` (rad), and, relative, `mass_matrix_error`,
        `gravity_error`, `bias_error`, all over `sample`. Bias is MuJoCo's qfrc_bias: what Coriolis,
        centrifugal and gravity forces ask of the joints.

    Raises:
        InputError: as `import_mujoco`.

    """
    mujoco = mujoco_package()
    compiled = load_model(model)
    plant = MultibodyPlant(0.0)
    plant.mutable_gravity_field().set_gravity_vector(compiled.opt.gravity)
    limb = import_mujoco(plant, compiled, **options)
    plant.Finalize()
    context, data = plant.CreateDefaultContext(), mujoco.MjData(compiled)
    random = np.random.default_rng(seed)
    rows = []
    with quiet_mujoco():  # it reports mass matrices near singular, which do no harm here
        for _ in range(samples):
            qpos = random_positions(limb, random)
            v = random.uniform(-speed, speed, plant.num_velocities())
            rows.append(_errors(limb, context, data, qpos, v))
    table = np.array(rows)
    result = xarray.Dataset(
        {
            name: ("sample", table[:, i], {"units": units, "long_name": title})
            for i, (name, (units, title)) in enumerate(_ERRORS.items())
        },
        coords={"sample": np.arange(samples)},
        attrs={"seed": seed, "largest_speed": speed},
    )
    result["sample"].attrs = {"units": "1", "long_name": "Random state"}
    return result


def random_positions(limb: ImportedLimb, random: np.random.Generator) -> NDArray[np.float64]:
    """A qpos (nq): joints of the limb anywhere within their ranges, all others where they start."""
    qpos, model = limb.tree.qpos.copy(), limb.tree.model
    for read, _ in limb.moving():
        at = int(model.jnt_qposadr[read.id])
        if read.kind == "ball":
            turn = random.normal(size=4)
            qpos[at : at + 4] = turn / np.linalg.norm(turn)
            continue
        lowest, highest = read.limits or (-FREE_RANGE[read.kind], FREE_RANGE[read.kind])
        qpos[at] = random.uniform(lowest, highest)
    return qpos


def mass_and_bias(
    model: Any, data: Any, qpos: NDArray[np.float64], qvel: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """MuJoCo's mass matrix (nv x nv, armature included) and qfrc_bias (nv) in one state."""
    mujoco = mujoco_package()
    data.qpos[:], data.qvel[:] = qpos, qvel
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    mass = np.zeros((model.nv, model.nv))
    for column, unit in enumerate(np.eye(model.nv)):  # mj_fullM's arguments differ by version
        mujoco.mj_mulM(model, data, mass[column], unit)
    return mass, np.array(data.qfrc_bias)


def _errors(
    limb: ImportedLimb,
    context: Context,
    data: Any,
    qpos: NDArray[np.float64],
    v: NDArray[np.float64],
) -> list[float]:
    """The five errors in one state; v are the plant's velocities."""
    model, plant = limb.tree.model, limb.limb.plant
    T = limb.velocity_map(qpos)
    at_q, at_v = limb.position_indices(), limb.velocity_indices()
    q = plant.GetPositions(context)
    q[at_q] = limb.positions(qpos)
    plant.SetPositions(context, q)
    gravity = -plant.CalcGravityGeneralizedForces(context)
    plant.SetVelocities(context, v)
    bias = plant.CalcBiasTerm(context) + gravity
    M = plant.CalcMassMatrix(context)[np.ix_(at_v, at_v)]
    mass, still = mass_and_bias(model, data, qpos, np.zeros(model.nv))
    _, moving = mass_and_bias(model, data, qpos, T @ v[at_v])
    scale = np.sqrt(np.outer(M.diagonal(), M.diagonal()))
    none = 1e-6 * float(M.diagonal().max())  # times 1 rad/s^2 or m/s^2: a smaller force is rounding
    return [
        *_pose_errors(limb, context, data),
        float(np.max(np.abs(T.T @ mass @ T - M) / scale)),
        _relative(T.T @ still, gravity[at_v], none),
        _relative(T.T @ moving, bias[at_v], none),
    ]


def _pose_errors(limb: ImportedLimb, context: Context, data: Any) -> tuple[float, float]:
    plant = limb.limb.plant
    apart, turned = 0.0, 0.0
    for body in limb.tree.bodies:
        X_WB = plant.EvalBodyPoseInWorld(context, limb.bodies[body.name])
        X_BM: RigidTransform = X_WB.inverse() @ pose(data.xpos[body.id], data.xquat[body.id])
        apart = max(apart, float(np.linalg.norm(X_BM.translation())))
        R = X_BM.rotation().matrix()
        sine = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
        angle = np.arctan2(np.linalg.norm(sine), 0.5 * (np.trace(R) - 1.0))
        turned = max(turned, float(angle))  # exact for small angles, where arccos is not
    return apart, turned


def _relative(expected: NDArray[np.float64], found: NDArray[np.float64], least: float) -> float:
    """The largest difference over the largest force, or over `least` where that is larger."""
    return float(np.max(np.abs(expected - found)) / max(np.max(np.abs(expected)), least))


def joint_table(limb: ImportedLimb) -> xarray.Dataset:
    """The tree's joints, over `joint`: what each is, on which body, and its numbers.

    A slide's are in m and N; a joint without limits has infinite ones, and a ball has none (NaN).
    """
    read = limb.tree.joints()
    body = {joint.name: body.name for body in limb.tree.bodies for joint in body.joints}
    limits = [j.limits or ((np.nan,) * 2 if j.kind == "ball" else (-np.inf, np.inf)) for j in read]
    columns: dict[str, tuple[list[Any], str, str]] = {
        "kind": ([j.kind for j in read], "", "Kind of joint"),
        "body": ([body[j.name] for j in read], "", "Body that it moves"),
        "locked": ([int(j.locked) for j in read], "1", "1 if locked, 0 if free"),
        "value": ([j.value for j in read], "rad", "Position at the start, or locked at"),
        "lowest": ([low for low, _ in limits], "rad", "Lower limit"),
        "highest": ([high for _, high in limits], "rad", "Upper limit"),
        "damping": ([j.damping for j in read], "N*m*s/rad", "Damping"),
        "armature": ([j.armature for j in read], "kg*m^2", "Armature (reflected inertia)"),
        "stiffness": ([j.stiffness for j in read], "N*m/rad", "Stiffness"),
    }
    result = xarray.Dataset(
        {
            name: ("joint", values, {"units": units, "long_name": title})
            for name, (values, units, title) in columns.items()
        },
        coords={"joint": [j.name for j in read]},
    )
    result["joint"].attrs = {"units": "", "long_name": "Joint"}
    return result
