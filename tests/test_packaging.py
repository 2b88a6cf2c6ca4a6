"""The package finds its files where it is installed: from a source tree, and from a wheel."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from drake_racket.io.shipped import data_directory, sdf_directory

ROOT = Path(__file__).resolve().parents[1]
DATA = {
    "speeds.yaml",
    "backhand.yaml",
    "ball_penn_titanium.yaml",
    "ball_penn_titanium_slow.yaml",
    "grip_hand_light.yaml",
    "grip_hand_medium.yaml",
    "grip_hand_tight.yaml",
    "grip_loose.yaml",
    "grip_normal.yaml",
    "grip_tight.yaml",
    "published.yaml",
    "references.yaml",
    "upper_limb.yaml",
    "recreational_high.yaml",
    "recreational_low.yaml",
    "tour_high.yaml",
    "tour_low.yaml",
}
SDF = {
    "ball.sdf",
    "package.xml",
    "racket_recreational.sdf",
    "racket_tour.sdf",
    "upper_limb.sdf",
    "upper_limb_left.sdf",
}

# What a user does after `pip install`: no file of the repository may be needed for it.
SCRIPT = """
from pathlib import Path
import sys

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

import drake_racket

directory = Path(sys.argv[1]).resolve()
assert Path(drake_racket.__file__).resolve().is_relative_to(directory), drake_racket.__file__
assert drake_racket.sdf_directory().is_relative_to(directory), drake_racket.sdf_directory()
for racket in ("tour", "recreational"):
    for tension in ("low", "high"):
        assert drake_racket.load_racket(racket, tension).name == f"{racket}_{tension}"
assert drake_racket.load_ball().mass.value == 0.059

plant = MultibodyPlant(0.0)
parser = Parser(plant)
parser.SetStrictParsing()
drake_racket.add_to_package_map(parser.package_map())
(instance,) = parser.AddModels(url="package://drake_racket/racket_tour.sdf")
racket = drake_racket.find_racket(plant, instance, drake_racket.load_racket("tour"))
plant.Finalize()
print(len(racket.string_masses), drake_racket.simulate(history=False).touches)
"""


def python(*arguments: str, **options) -> str:
    done = subprocess.run(
        [sys.executable, *arguments],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        **options,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    directory = tmp_path_factory.mktemp("wheel")
    arguments = ["-m", "pip", "wheel", "--no-deps", "--quiet", "--disable-pip-version-check"]
    if importlib.util.find_spec("hatchling"):
        arguments.append("--no-build-isolation")  # the backend is here: nothing to download
    python(*arguments, "--wheel-dir", str(directory), str(ROOT))
    (path,) = directory.glob("drake_racket-*.whl")
    return path


def test_the_source_tree_finds_its_files():
    assert {path.name for path in data_directory().iterdir()} == DATA
    assert {path.name for path in sdf_directory().iterdir()} == SDF
    for path in (data_directory(), sdf_directory()):
        assert path.is_absolute()


def test_the_wheel_holds_the_package_its_data_and_its_models(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        text = archive.read("drake_racket/sdf/racket_tour.sdf")
    assert "drake_racket/py.typed" in names
    assert {f"drake_racket/parameters/data/{name}" for name in DATA} <= names
    assert {f"drake_racket/sdf/{name}" for name in SDF} <= names
    assert "drake_racket/studies/first_impact.py" in names  # what `drake-racket examples` copies
    modules = {f"drake_racket/{path.name}" for path in (ROOT / "drake_racket").glob("*.py")}
    assert modules <= names
    assert text == (ROOT / "sdf" / "racket_tour.sdf").read_bytes()
    # one package, and no compiled leftovers of this machine
    assert {name.split("/")[0].split("-")[0] for name in names} == {"drake_racket"}
    assert not [name for name in names if "__pycache__" in name or name.endswith((".nbi", ".nbc"))]
    (metadata,) = (name for name in names if name.endswith("entry_points.txt"))
    with zipfile.ZipFile(wheel) as archive:
        assert b"drake-racket = drake_racket.cli:main" in archive.read(metadata)


def test_the_wheel_works_away_from_the_repository(wheel, tmp_path):
    target, elsewhere = tmp_path / "installed", tmp_path / "elsewhere"
    elsewhere.mkdir()
    arguments = ["-m", "pip", "install", "--no-deps", "--no-index", "--quiet"]
    python(*arguments, "--disable-pip-version-check", "--target", str(target), str(wheel))
    environment = {**os.environ, "PYTHONPATH": str(target)}
    out = python("-c", SCRIPT, str(target), cwd=elsewhere, env=environment)
    assert out.split() == ["9", "1"]
    help_text = python("-m", "drake_racket.cli", "--help", cwd=elsewhere, env=environment)
    assert "impact" in help_text


@pytest.mark.skipif(importlib.util.find_spec("hatchling") is None, reason="needs hatchling")
def test_the_source_distribution_makes_the_same_wheel(wheel, tmp_path):
    build = ["-m", "hatchling", "build", "-d", str(tmp_path)]
    python(*build, "-t", "sdist", cwd=ROOT)
    (sdist,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        names = {name.split("/", 1)[-1] for name in archive.getnames()}
        archive.extractall(tmp_path, filter="data")
    assert {"README.md", "CHANGELOG.md", "CONTRIBUTING.md", "CITATION.cff", "LICENSE"} <= names
    assert {"mkdocs.yml", "manual/hooks.py", "docs/index.md", "tests/conftest.py"} <= names
    assert {"docs/figures/first_impact.gif", "docs/tutorials/first_impact.ipynb"} <= names
    assert not [name for name in names if name.startswith(("site/", "docs/validation/data/"))]
    assert not [name for name in names if name.endswith((".sqlite", ".pyc", ".nbi", ".nbc"))]
    (source,) = (path for path in tmp_path.iterdir() if path.is_dir())
    python(*build, "-t", "wheel", cwd=source)
    (again,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as first, zipfile.ZipFile(again) as second:
        crcs = [{f.filename: f.CRC for f in z.infolist()} for z in (first, second)]
    assert crcs[0] == crcs[1]


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("twine") is None, reason="needs the extra docs")
@pytest.mark.skipif(importlib.util.find_spec("hatchling") is None, reason="needs hatchling")
def test_an_index_would_take_both(tmp_path):
    python("-m", "hatchling", "build", "-d", str(tmp_path), cwd=ROOT)
    files = sorted(str(path) for path in tmp_path.iterdir())
    assert len(files) == 2
    assert python("-m", "twine", "check", "--strict", *files).count("PASSED") == 2


def test_the_metadata_say_what_it_is_and_invent_no_address(wheel):
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith("dist-info/METADATA"))
        lines = archive.read(name).decode().splitlines()
    assert "License-Expression: BSD-3-Clause" in lines
    assert "Classifier: Topic :: Scientific/Engineering :: Physics" in lines
    assert sorted(line for line in lines if line.startswith("Project-URL")) == [
        "Project-URL: Drake, https://drake.mit.edu",
        "Project-URL: Paper of the model, https://doi.org/10.1007/s12283-010-0056-x",
    ]
