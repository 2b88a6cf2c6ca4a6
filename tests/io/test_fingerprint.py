"""One fingerprint: what makes a computation another one, and what does not."""

from __future__ import annotations

import functools
import importlib.metadata
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from drake_racket.io import fingerprint
from drake_racket.io.fingerprint import code_of, computation, difference, versions
from drake_racket.io.shipped import sdf_directory
from tests.conftest import ROOT


@pytest.fixture(autouse=True)
def forgotten():
    """What is known of the package is looked up anew in every test, and after it."""
    computation.cache_clear()
    versions.cache_clear()
    yield
    computation.cache_clear()
    versions.cache_clear()


@pytest.fixture
def package(tmp_path, monkeypatch) -> Path:
    """A copy of the package that counts instead of the package."""
    root = tmp_path / "drake_racket"
    hidden = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "drake_racket", root, ignore=hidden)
    shutil.copytree(sdf_directory(), tmp_path / "sdf")
    monkeypatch.setattr(fingerprint, "_ROOT", root)
    monkeypatch.setattr(fingerprint, "sdf_directory", lambda: tmp_path / "sdf")
    return root


def other_numba(name: str, real=importlib.metadata.distribution):
    return SimpleNamespace(version="0.0") if name == "numba" else real(name)


@pytest.mark.parametrize(
    ("key", "name", "value"),
    [
        ("python", "platform.python_version", lambda: "3.11.99"),
        ("machine", "platform.machine", lambda: "another"),
        ("numba", "importlib.metadata.distribution", other_numba),
    ],
)
def test_another_environment_is_another_computation(monkeypatch, key, name, value):
    here = computation()
    computation.cache_clear()
    versions.cache_clear()
    monkeypatch.setattr(name, value)
    assert difference(here, computation())[0] == key
    assert {"python", "machine", "source", "drake", "numpy", "scipy"} <= set(here)


COUNTS = [
    "laws/contact.py",
    "parameters/data/tour_low.yaml",
    "../sdf/racket_tour.sdf",
    "sweep/worker.py",
    "simulation.py",
    "rigs/head_clamped.py",
]
COUNTS_NOT = [
    "plots/style.py",
    "cli/__init__.py",
    "animation/camera.py",
    "identify/core/search.py",
    "validation/run.py",
]


def append(path: Path) -> str:
    """Another `source`, with a line more in a file."""
    with path.open("a") as file:
        file.write("\n# another\n")
    computation.cache_clear()
    return computation()["source"]


def test_what_decides_numbers_counts_and_nothing_else(package):
    last = computation()["source"]
    for name in COUNTS:
        assert append(package / name) != last, name
        last = computation()["source"]
    for name in COUNTS_NOT:
        assert append(package / name) == last, name
    (package / "laws" / "another.py").write_text("")
    computation.cache_clear()
    assert computation()["source"] != last


def test_rooms_above_and_code_of_ones_own_count_where_they_take_part(package, tmp_path):
    own = tmp_path / "study"
    own.mkdir()
    (own / "one.py").write_text("x = 1")
    with_fits, with_own = computation("identify")["source"], computation(own)["source"]
    assert len({with_fits, with_own, computation()["source"]}) == 3
    append(package / "identify" / "core" / "search.py")
    assert computation("identify")["source"] != with_fits
    assert computation("validation")["source"] != computation("identify")["source"]
    assert computation(own)["source"] == with_own
    append(own / "one.py")
    assert computation(own)["source"] != with_own


def test_the_code_of_a_callers_own_class_is_its_file():
    class Own:
        pass

    assert code_of(Own) == (Path(__file__).resolve(),)
    assert code_of(computation) == ()
    assert code_of(functools.partial(other_numba, "numba")) == (Path(__file__).resolve(),)
    assert code_of(len) == ()
