"""Loads the optional package `mujoco`, its compiled models, and the names in them."""

from __future__ import annotations

import contextlib
import importlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from drake_racket.io.errors import InputError, one_line


def mujoco_package() -> Any:
    """Gives the `mujoco` package.

    Raises:
        InputError: it is not installed.

    """
    try:
        return importlib.import_module("mujoco")
    except ImportError:
        raise InputError(
            "mujoco", "not installed", "pip install 'drake-racket[mujoco]' for this import"
        ) from None


@contextlib.contextmanager
def quiet_mujoco() -> Iterator[None]:
    """Drops MuJoCo's own warnings, which it prints and appends to MUJOCO_LOG.TXT where it runs."""
    mujoco = mujoco_package()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(None)


def load_model(model: Any) -> Any:
    """Gives a compiled `mujoco.MjModel`: the one given, or the one of an .xml or .mjb file.

    Raises:
        InputError: the package is missing, or there is no such model.

    """
    mujoco = mujoco_package()
    if isinstance(model, mujoco.MjModel):
        return model
    if not isinstance(model, str | Path) or Path(model).suffix.lower() not in (".xml", ".mjb"):
        raise InputError("import_mujoco: model", model, "an MjModel or a path to .xml or .mjb")
    if not Path(model).is_file():  # MuJoCo would leave a log file behind
        raise InputError("import_mujoco: model", Path(model), "a file that exists")
    binary = Path(model).suffix.lower() == ".mjb"
    load = mujoco.MjModel.from_binary_path if binary else mujoco.MjModel.from_xml_path
    try:
        return load(str(model))
    except (ValueError, RuntimeError) as error:
        reason = one_line(str(error), 200)
        raise InputError(
            "import_mujoco: model", Path(model), f"a model that MuJoCo loads ({reason})"
        ) from None


def body_name(model: Any, body: int) -> str:
    """Gives a body's name, or for one that has none body_<id>, with _ if that is another's."""
    return str(model.body(body).name) or _unnamed(model, "body", body)


def joint_name(model: Any, joint: int) -> str:
    """Gives a joint's name, or for one that has none joint_<id>, with _ if that is another's."""
    return str(model.joint(joint).name) or _unnamed(model, "joint", joint)


def _unnamed(model: Any, kind: str, number: int) -> str:
    mujoco = mujoco_package()
    types = {"body": mujoco.mjtObj.mjOBJ_BODY, "joint": mujoco.mjtObj.mjOBJ_JOINT}
    name = f"{kind}_{number}"
    while mujoco.mj_name2id(model, types[kind], name) >= 0:
        name += "_"
    return name


def enabled(model: Any, what: str) -> bool:
    """Tells whether a model's option flag leaves something on: gravity, limit, spring, ...

    Args:
        what: as the flag is named in a model file. `spring` and `damper` are one flag, `passive`,
            in older versions of MuJoCo.

    """
    bits = mujoco_package().mjtDisableBit
    names = (f"mjDSBL_{what.upper()}", "mjDSBL_PASSIVE" if what in ("spring", "damper") else "")
    mask = sum({int(getattr(bits, name)) for name in names if hasattr(bits, name)})
    return not int(model.opt.disableflags) & mask
