"""The MuJoCo import against MuJoCo itself: poses, mass matrix, forces, accelerations."""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
import warnings

import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import PrismaticJoint, RevoluteJoint

from drake_racket.io.errors import InputError
from drake_racket.limbs.left_out import LeftOut
from drake_racket.limbs.mujoco import model as mujoco_model
from drake_racket.limbs.mujoco.importer import import_mujoco
from drake_racket.limbs.mujoco.model import quiet_mujoco
from studies.myosim_arm.compare import (
    compare_with_mujoco,
    joint_table,
    mass_and_bias,
    random_positions,
)
from tests.conftest import ROOT

mujoco = pytest.importorskip("mujoco")

LARGEST = {
    "position_error": 1e-10,
    "rotation_error": 1e-10,
    "mass_matrix_error": 1e-9,
    "gravity_error": 1e-9,
    "bias_error": 1e-9,
}

INERTIAL = (
    '<inertial pos="0.02 -0.03 0.1" euler="20 40 -70" mass="1.3" diaginertia="3e-3 4e-3 5e-3"/>'
)


def mjcf(bodies: str, rest: str = "") -> str:
    return f"""<mujoco><compiler angle="radian" autolimits="true"/>
      <option gravity="0.3 -0.2 -9.81"><flag contact="disable"/></option>
      <worldbody>{bodies}</worldbody>{rest}</mujoco>"""


def body(name: str, inside: str, pos: str = "0.1 0.2 -0.3", euler: str = "0.3 -0.8 1.1") -> str:
    return f'<body name="{name}" pos="{pos}" euler="{euler}">{inside}</body>'


# slides and hinges on one body with anchors and references, a static body between, a turned inertia
SEVERAL = mjcf(
    body(
        "upper",
        INERTIAL
        + """<joint name="s" type="slide" axis="1 2 0" ref="0.1" armature="0.2" damping="3"
               stiffness="40" springref="0.15" range="-0.4 0.4"/>
             <joint name="h1" axis="0 1 1" pos="0.05 -0.1 0.2" ref="0.4" damping="0.3"/>
             <joint name="h2" axis="1 0 -1" pos="0 0.3 0.1" armature="0.03" stiffness="2"
               springref="0.7"/>"""
        + body(
            "between",
            INERTIAL + body("lower", INERTIAL + '<joint name="h3" axis="0 0 1" range="-1 2"/>'),
        ),
    )
)
BALL = mjcf(
    body(
        "ball",
        INERTIAL
        + """<joint name="s" type="slide" axis="0 0 1"/>
             <joint name="b" type="ball" pos="0.1 0 -0.2" damping="0.2"/>"""
        + body("tip", INERTIAL + '<joint name="h" axis="1 1 0" pos="0 0.1 0"/>'),
    )
)
MASSLESS = mjcf(
    body(
        "stump",
        '<joint name="h1" axis="0 1 0"/>'
        + body("mass", INERTIAL)
        + body("light", INERTIAL + '<joint name="h2" axis="1 0 0"/>' + body("empty", "")),
    )
)
COUPLED = mjcf(
    body(
        "a",
        INERTIAL
        + '<joint name="x" axis="0 1 0" ref="0.2"/><joint name="y" axis="1 0 0" ref="-0.1"/>'
        + body(
            "c",
            INERTIAL + '<joint name="z" axis="1 1 0"/>' + body("d", INERTIAL + '<joint name="w"/>'),
        ),
    ),
    """<equality>
         <joint name="yx" joint1="y" joint2="x" polycoef="0.1 0.5 -0.3 0.2 0.05"/>
         <joint name="zy" joint1="z" joint2="y" polycoef="0 2 0 0 0"/>
         <joint name="off" joint1="w" joint2="x" active="false"/>
       </equality>""",
)


def compile_model(text: str):
    return mujoco.MjModel.from_xml_string(text)


def imported(model, **options):
    plant = MultibodyPlant(0.0)
    plant.mutable_gravity_field().set_gravity_vector(model.opt.gravity)
    limb = import_mujoco(plant, model, **options)
    plant.Finalize()
    return plant, limb, plant.CreateDefaultContext()


def check_agreement(model, samples: int = 100, **options) -> None:
    errors = compare_with_mujoco(model, samples=samples, **options)
    for name, largest in LARGEST.items():
        assert float(errors[name].max()) < largest, name


@pytest.mark.parametrize(
    ("text", "options"),
    [
        (SEVERAL, {}),
        (SEVERAL, {"root": "between"}),
        (SEVERAL, {"root": "lower", "reference": {"h1": 0.7, "s": -0.2}}),
        (SEVERAL, {"locked": {"h1": 0.7}}),
        (SEVERAL, {"locked": {"s": 0.3, "h2": -1.2}}),
        (SEVERAL, {"locked": {"s": 0.3, "h1": 0.1, "h2": -1.2}}),
        (BALL, {}),
        (MASSLESS, {"hand": "empty"}),
        (COUPLED, {}),
        (COUPLED, {"couplings": "keep"}),
        (COUPLED, {"reference": {"x": 1.1}}),
        (COUPLED, {"locked": {"x": 1.1}}),
    ],
)
def test_tree_is_mujocos(text, options):
    check_agreement(compile_model(text), **options)


@pytest.mark.parametrize("text", [SEVERAL, BALL, MASSLESS])
def test_accelerations_are_mujocos(text):
    # with springs, damping, armature and gravity: what a simulation would do
    model = compile_model(text)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    hand = "empty" if text is MASSLESS else None
    plant, limb, context = imported(model, hand=hand)
    data, random = mujoco.MjData(model), np.random.default_rng(3)
    for _ in range(20):
        qpos = random_positions(limb, random)
        v = random.uniform(-3.0, 3.0, plant.num_velocities())
        T = limb.velocity_map(qpos)
        data.qpos[:], data.qvel[:] = qpos, T @ v
        mujoco.mj_forward(model, data)
        plant.SetPositions(context, limb.positions(qpos))
        plant.SetVelocities(context, v)
        vdot = plant.EvalTimeDerivatives(context).CopyToVector()[plant.num_positions() :]
        np.testing.assert_allclose(T @ vdot, data.qacc, rtol=1e-9, atol=1e-9 * abs(data.qacc).max())


def test_pendulum_by_hand():
    # hinge along y, anchor 0.3 m above the origin, a point mass 0.2 m below: l = 0.5 m
    text = mjcf(
        '<body name="bob"><inertial pos="0 0 -0.2" mass="2" diaginertia="0.01 0.01 0.01"/>'
        '<joint name="swing" axis="0 1 0" pos="0 0 0.3" armature="0.07"/></body>'
    )
    plant, limb, context = imported(compile_model(text))
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -9.81])
    plant.SetPositions(context, [0.4])
    assert plant.CalcMassMatrix(context)[0, 0] == pytest.approx(2.0 * 0.25 + 0.01 + 0.07)
    torque = plant.CalcGravityGeneralizedForces(context)[0]
    assert torque == pytest.approx(-2.0 * 9.81 * 0.5 * math.sin(0.4))
    p_WH = limb.limb.hand.CalcPoseInWorld(context).translation()
    np.testing.assert_allclose(
        p_WH, [-0.3 * math.sin(0.4), 0, 0.3 * (1 - math.cos(0.4))], atol=1e-15
    )


def test_joints_keep_names_order_and_numbers():
    plant, limb, context = imported(compile_model(SEVERAL))
    assert limb.limb.joint_names() == ["s", "h1", "h2", "h3"]
    s, h1, h2, h3 = limb.limb.joints
    assert isinstance(s, PrismaticJoint)
    assert isinstance(h3, RevoluteJoint)
    np.testing.assert_allclose([s.position_lower_limit(), s.position_upper_limit()], [-0.4, 0.4])
    assert h1.position_upper_limit() == math.inf
    assert (s.default_damping(), h1.default_damping()) == (3.0, 0.3)
    q = plant.GetPositions(context)[limb.limb.position_indices()]
    np.testing.assert_allclose(q, [0.1, 0.4, 0.0, 0.0], atol=1e-15)
    assert h2.name() in joint_table(limb)["joint"].to_numpy()


def test_a_balls_armature_is_what_is_missing():
    model = compile_model(BALL.replace('type="ball"', 'type="ball" armature="0.05" stiffness="3"'))
    plant, limb, context = imported(model)
    assert limb.left_out.names("ball joints' armature") == ("b",)
    assert limb.left_out.names("ball joints' stiffness") == ("b",)
    qpos = random_positions(limb, np.random.default_rng(1))
    plant.SetPositions(context, limb.positions(qpos))
    T = limb.velocity_map(qpos)
    mass, _ = mass_and_bias(model, mujoco.MjData(model), qpos, np.zeros(model.nv))
    missing = T.T @ mass @ T - plant.CalcMassMatrix(context)
    np.testing.assert_allclose(missing, np.diag([0, 0.05, 0.05, 0.05, 0]), atol=1e-14)


def test_locked_couplings_meet_mujocos_constraint():
    model = compile_model(COUPLED)
    _, limb, _ = imported(model, reference={"x": 1.1})
    assert limb.limb.joint_names() == ["x", "w"]
    assert limb.locked.keys() == {"y", "z"}
    assert limb.left_out.names("joint couplings") == ("y", "z")
    assert limb.left_out.names("inactive joint couplings") == ("off",)
    data = mujoco.MjData(model)
    data.qpos[:] = limb.tree.qpos
    mujoco.mj_forward(model, data)
    assert data.joint("x").qpos[0] == 1.1
    assert data.nefc == 2
    np.testing.assert_allclose(data.efc_pos, 0.0, atol=1e-15)
    _, kept, _ = imported(model, couplings="keep")
    assert kept.limb.joint_names() == ["x", "y", "z", "w"]
    assert kept.locked == {}


def test_parent_and_hand_frames():
    model = compile_model(SEVERAL)
    X_PF = RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [1, 2, 3])
    X_BH = RigidTransform(RollPitchYaw(-0.4, 0.5, 0.6), [0.1, 0, 0])
    _, limb, context = imported(model, root="between", X_PF=X_PF, X_BH=X_BH, hand="lower")
    # F is the body that carries the root: upper
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    X_WU, X_WL = (
        mujoco_pose(data.body(name).xpos, data.body(name).xmat) for name in ("upper", "lower")
    )
    expected = X_PF @ X_WU.inverse() @ X_WL @ X_BH
    found = limb.limb.hand.CalcPoseInWorld(context)
    np.testing.assert_allclose(found.GetAsMatrix4(), expected.GetAsMatrix4(), atol=1e-14)
    assert limb.left_out.names("bodies outside the subtree") == ("upper",)
    assert limb.limb.joint_names() == ["h3"]


def mujoco_pose(position, matrix) -> RigidTransform:
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = np.reshape(matrix, (3, 3)), position
    return RigidTransform(X)


RICH = mjcf(
    body("arm", INERTIAL + '<joint name="h" frictionloss="0.1" stiffness="1"/><geom size="0.1"/>'
         '<geom name="ghost" size="0.1" contype="0" conaffinity="0"/><site name="heel"/>'
         '<site name="palm" pos="0 0 0.2" euler="0 0.5 0"/>').replace("<body", '<body gravcomp="1"')
    + '<body name="racketball" pos="1 2 3"><freejoint name="fly"/><geom size="0.03"/></body>'
    + '<body name="target" mocap="true" pos="0 1 0"/>',
    """<option density="1.2"/>
       <tendon><spatial name="t"><site site="palm"/><site site="heel"/></spatial></tendon>
       <actuator><motor name="m" joint="h"/><muscle name="biceps" tendon="t" lengthrange="0 1"/>
       </actuator>
       <equality><connect name="c" body1="arm" anchor="0 0 0"/></equality>
       <sensor><jointpos name="see" joint="h"/></sensor>
       <contact><exclude name="never" body1="arm" body2="racketball"/></contact>""",
)  # fmt: skip


def test_what_is_left_out_is_listed():
    model = compile_model(RICH)
    model.body_inertia[model.body("target").id] = 1e-3
    _, limb, context = imported(model, hand="palm", couplings="keep")
    expected = {
        "free joints": ("fly",),
        "muscles": ("biceps",),
        "other actuators": ("m",),
        "tendons": ("t",),
        "other equality constraints": ("c",),
        "dry friction of joints": ("h",),
        "geoms that can touch": ("geom_0", "geom_2"),
        "other geoms": ("ghost",),
        "sensors": ("see",),
        "sites": ("heel", "palm"),
        "gravity compensation": ("arm",),
        "mocap bodies": ("target",),
        "inertias without mass": ("target",),
        "fluid forces": ("density",),
        "contact exclusions": ("never",),
        "gravity": ("(0.3, -0.2, -9.81) m/s^2",),
    }
    assert {item.kind: item.names for item in limb.left_out.items} == expected
    lines = limb.left_out.table().splitlines()
    assert len(lines) == len(expected)
    assert any("biceps" in line for line in lines)
    assert LeftOut(()).table() == "nothing left out"
    X_WR = limb.bodies["racketball"].EvalPoseInWorld(context)
    np.testing.assert_allclose(X_WR.translation(), [1.0, 2.0, 3.0])
    data = mujoco.MjData(limb.tree.model)
    mujoco.mj_kinematics(limb.tree.model, data)
    X_WS = mujoco_pose(data.site("palm").xpos, data.site("palm").xmat)
    found = limb.limb.hand.CalcPoseInWorld(context)
    np.testing.assert_allclose(found.GetAsMatrix4(), X_WS.GetAsMatrix4(), atol=1e-14)


def test_files_load(tmp_path):
    (tmp_path / "a.xml").write_text(SEVERAL)
    mujoco.mj_saveModel(compile_model(SEVERAL), str(tmp_path / "a.mjb"), None)
    for suffix in ("xml", "mjb"):
        plant = MultibodyPlant(0.0)
        limb = import_mujoco(plant, tmp_path / f"a.{suffix}")
        assert len(limb.joints) == 4
    (tmp_path / "bad.xml").write_text("<mujoco><worldbody><body></mujoco>")
    for name in ("bad.xml", "none.xml", "none.mjb"):
        with pytest.raises(InputError, match="model"):
            import_mujoco(MultibodyPlant(0.0), tmp_path / name)


@pytest.mark.parametrize(
    ("text", "options", "says"),
    [
        (SEVERAL, {"root": "wrist"}, "upper, between, lower"),
        (SEVERAL, {"hand": "wrist"}, "upper, between, lower"),
        (SEVERAL, {"hand": ""}, "upper, between, lower"),
        (SEVERAL, {"root": "lower", "hand": "upper"}, "bodies: lower; sites: none there"),
        (MASSLESS, {}, "the tree ends in mass, empty"),
        (SEVERAL, {"couplings": "melt"}, "lock, keep"),
        (SEVERAL, {"locked": {"h9": 0.0}}, "s, h1, h2, h3"),
        (BALL, {"locked": {"b": 0.0}}, "hinges and slides: s, h"),
        (SEVERAL, {"reference": {"h1": math.nan}}, "a finite number"),
        (COUPLED, {"locked": {"y": 0.0}}, "a joint no coupling ties"),
        (SEVERAL, {"name": "left arm"}, "letters, digits and _"),
        ("<mujoco/>", {}, "a model with a body"),
    ],
)
def test_bad_input_is_refused_before_anything_is_added(text, options, says):
    plant = MultibodyPlant(0.0)
    with pytest.raises(InputError, match=says) as error:
        import_mujoco(plant, compile_model(text), **options)
    assert "\n" not in str(error.value)
    assert plant.num_bodies() == 1
    assert not plant.HasModelInstanceNamed("limb")


def test_models_that_drake_cannot_hold_are_refused():
    model = compile_model(SEVERAL)
    model.dof_damping[1] = -1.0
    with pytest.raises(InputError, match="damping of h1"):
        import_mujoco(MultibodyPlant(0.0), model)
    model = compile_model(SEVERAL)
    model.body_inertia[3] = [1.0, 1.0, 5.0]
    with pytest.raises(InputError, match="inertia of lower"):
        import_mujoco(MultibodyPlant(0.0), model)
    model = compile_model(SEVERAL)
    model.body_mass[3] = 0.0
    with pytest.raises(InputError, match="mass that h3 moves"):
        import_mujoco(MultibodyPlant(0.0), model)
    model = compile_model(COUPLED)
    model.eq_obj1id[1], model.eq_obj2id[1] = model.joint("x").id, model.joint("y").id
    with pytest.raises(InputError, match="circle"):
        import_mujoco(MultibodyPlant(0.0), model)
    model.eq_obj1id[1] = model.joint("y").id
    with pytest.raises(InputError, match="one active coupling"):
        import_mujoco(MultibodyPlant(0.0), model)


def test_a_joint_with_two_couplings_is_kept_or_refused_before_anything_is_added():
    model, plant = compile_model(COUPLED), MultibodyPlant(0.0)
    model.eq_obj1id[1] = model.joint("y").id
    with pytest.raises(InputError, match="couplings='keep'"):
        import_mujoco(plant, model)
    assert not plant.HasModelInstanceNamed("limb")
    limb = import_mujoco(plant, model, couplings="keep")
    assert limb.limb.joint_names() == ["x", "y", "z", "w"]
    assert limb.left_out.names("joint couplings") == ("y",)


def test_armature_alone_carries_a_massless_end():
    model = compile_model(SEVERAL.replace('name="h3"', 'name="h3" armature="0.02"'))
    model.body_mass[3], model.body_inertia[3] = 0.0, 0.0
    plant, _, context = imported(model)
    assert plant.CalcMassMatrix(context)[3, 3] == pytest.approx(0.02)
    assert np.all(np.isfinite(plant.EvalTimeDerivatives(context).CopyToVector()))
    check_agreement(model, samples=5)


def test_plants_that_cannot_take_a_limb():
    model, plant = compile_model(SEVERAL), MultibodyPlant(0.0)
    import_mujoco(plant, model)
    with pytest.raises(InputError, match="name"):
        import_mujoco(plant, model)
    import_mujoco(plant, model, name="other")
    plant.Finalize()
    assert plant.num_velocities() == 8
    with pytest.raises(InputError, match="finalized"):
        import_mujoco(plant, model, name="third")


def test_nameless_bodies_and_joints():
    three = '<joint name="a_link"/><joint name="a" axis="1 0 0"/><joint axis="0 1 0"/>'
    text = mjcf(f"<body>{INERTIAL}<joint/></body>" + body("b", INERTIAL + three))
    _, limb, _ = imported(compile_model(text), hand="body_1")
    assert list(limb.joints) == ["joint_0", "a_link", "a", "joint_3"]
    assert limb.limb.joint_names() == ["joint_0"]
    check_agreement(compile_model(text), samples=5, hand="b")


def test_without_mujoco_one_line_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(InputError, match=r"drake-racket\[mujoco\]"):
        mujoco_model.mujoco_package()


numbers = st.floats(-1.0, 1.0).map(lambda x: round(x, 3))
axes = st.tuples(*[st.integers(-3, 3)] * 3).filter(any)


def triple(values) -> str:
    return " ".join(f"{x:g}" for x in values)


@st.composite
def joints_of(draw, count: int, at_least: int) -> str:
    ball = draw(st.booleans())
    result = ""
    for i in range(draw(st.integers(at_least, 3))):
        kind = "slide" if ball else draw(st.sampled_from(["hinge", "slide"]))
        kind = "ball" if ball and i == 0 else kind
        ref = "" if kind == "ball" else f'ref="{draw(numbers):g}" armature="{abs(draw(numbers)):g}"'
        result += (
            f'<joint name="j{count}{i}" type="{kind}" axis="{triple(draw(axes))}"'
            f' pos="{triple(draw(st.tuples(*[numbers] * 3)))}" {ref}/>'
        )
    return result


@st.composite
def trees(draw) -> str:
    count = draw(st.integers(2, 5))
    parents = [-1, *(draw(st.integers(-1, i - 1)) for i in range(1, count))]
    heads, inside = [], [""] * count
    vector = st.tuples(numbers, numbers, numbers)
    for i in range(count):
        a, b, c = (x * x + 1e-4 for x in draw(vector))  # second moments: any such body exists
        mass = draw(st.sampled_from([1e-3, 0.1, 2.0]))
        heads.append(
            f'pos="{triple(draw(vector))}" euler="{triple(draw(vector))}"><inertial'
            f' pos="{triple(draw(vector))}" euler="{triple(draw(vector))}" mass="{mass}"'
            f' diaginertia="{mass * (b + c)} {mass * (a + c)} {mass * (a + b)}"/>'
            + draw(joints_of(i, int(i == 0)))
        )
    for i in reversed(range(count)):
        text = f'<body name="b{i}" {heads[i]}{inside[i]}</body>'
        if parents[i] < 0:
            heads[i] = text
        else:
            inside[parents[i]] = text + inside[parents[i]]
    return mjcf("".join(heads[i] for i in range(count) if parents[i] < 0))


@settings(max_examples=40, deadline=None)
@given(text=trees())
def test_any_tree_is_mujocos(text):
    model = compile_model(text)
    check_agreement(model, samples=3, hand="b0")


@pytest.fixture(scope="module")
def arm():
    myo_sim = pytest.importorskip("myo_sim")
    with quiet_mujoco(), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # on saving the assembled parts
        return myo_sim.load_model("myoarm_r")


@pytest.mark.parametrize("couplings", ["lock", "keep"])
def test_myosim_arm_is_mujocos(arm, couplings):
    check_agreement(arm, root="clavicle_r", hand="thirdmc_r", couplings=couplings)


def test_fist_holds_one_straight_grip(arm):
    from studies.myosim_arm.hand import (
        GRIP_RADIUS,
        HAND,
        finger_centres,
        fist,
        grip_in_hand,
    )

    locked = fist(arm)
    _, limb, context = imported(arm, hand=HAND, X_BH=grip_in_hand(arm), locked=locked)
    assert limb.limb.joint_names() == [
        "elv_angle_r", "shoulder_elv_r", "shoulder_rot_r", "elbow_flexion_r", "pro_sup_r",
        "deviation_r", "flexion_r",
    ]  # fmt: skip
    assert len(locked) == 20
    # the joints of all four fingers lie around the axis, at the radius asked for, to 5 mm
    H = limb.limb.hand.CalcPoseInWorld(context)
    for finger in (2, 3, 4, 5):
        for bone in (f"{finger}proxph_r", f"midph{finger}_r", f"distph{finger}_r"):
            p_HJ = H.inverse() @ limb.bodies[bone].EvalPoseInWorld(context).translation()
            assert math.hypot(p_HJ[1], p_HJ[2]) == pytest.approx(GRIP_RADIUS, abs=5e-3)
    index, little = (
        H.inverse() @ limb.bodies[f"{i}proxph_r"].EvalPoseInWorld(context).translation()
        for i in (2, 5)
    )
    assert index[0] > 0.0 > little[0]  # x leaves on the thumb's side
    tips = [
        limb.bodies[f"distph{i}_r"].EvalPoseInWorld(context).translation() for i in (2, 3, 4, 5)
    ]
    assert all((H.inverse() @ tip)[2] > 0.0 for tip in tips)  # fingers close on the palm's side
    assert finger_centres(arm).shape == (4, 3)
    with pytest.raises(InputError, match="radius"):
        fist(arm, 0.01)
    with pytest.raises(InputError, match="myoarm_r"):
        fist(compile_model(SEVERAL))


@pytest.mark.slow
def test_study(tmp_path, arm):
    command = [sys.executable, "-m", "studies.myosim_arm", "--samples", "3", "--fist"]
    command += ["--after", "0.006", "--out", str(tmp_path / "o")]
    options = {"capture_output": True, "text": True, "cwd": tmp_path}
    options["env"] = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, check=True, **options)
    assert "7 degrees of freedom of 38" in done.stdout
    closure = float(re.search(r"energy closes to ([\d.e-]+)", done.stdout)[1])
    assert closure < 1e-4  # the arm's rotors and springs are in the balance
    with xarray.open_dataset(tmp_path / "o" / "impact.nc", engine="h5netcdf") as impact:
        assert impact.sizes["joint"] == 7
        assert float(impact["normal_force"].max()) > 500.0
    with xarray.open_dataset(tmp_path / "o" / "errors.nc", engine="h5netcdf") as errors:
        assert errors.sizes["sample"] == 3
        assert float(errors["mass_matrix_error"].max()) < 1e-9
    with xarray.open_dataset(tmp_path / "o" / "joints.nc", engine="h5netcdf") as joints:
        assert int(joints["locked"].sum()) == 31
        assert float(joints["damping"].sel(joint="elbow_flexion_r")) == 0.75
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()
    assert (tmp_path / "o" / "joints.csv").read_text().startswith("joint,kind,body,locked [1]")
    wrong = subprocess.run([*command, "--root", "nose"], **options)
    assert wrong.returncode == 2
    assert "root: got 'nose'" in wrong.stderr
