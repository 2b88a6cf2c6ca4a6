"""The tutorials run as notebooks and print what their pages show."""

from __future__ import annotations

import re

import pytest

from tests.conftest import ROOT

pytestmark = pytest.mark.slow
pytest.importorskip("nbclient", reason="needs the extra docs")

import nbformat  # noqa: E402

from manual.tutorials import TUTORIALS, printed, run  # noqa: E402

NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
EFFORT = re.compile(r"Integrator .*|Balance closes .*|the sum is constant .*|<\w+Figure .*")
"""What another processor may compute otherwise, or matplotlib show otherwise."""


def comparable(text: str) -> tuple[str, list[float]]:
    text = EFFORT.sub("", text)
    return NUMBER.sub("#", text), [float(number) for number in NUMBER.findall(text)]


def test_there_are_four():
    assert len(list(TUTORIALS.glob("*.ipynb"))) == 4
    assert TUTORIALS == ROOT / "docs" / "tutorials"


@pytest.mark.parametrize("path", sorted(TUTORIALS.glob("*.ipynb")), ids=lambda path: path.stem)
def test_it_prints_what_its_page_shows(path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    shown = printed(nbformat.read(path, as_version=4))
    now = printed(run(path))
    assert len(now) == len(shown)
    for before, after in zip(map(comparable, shown), map(comparable, now), strict=True):
        assert after[0] == before[0]
        assert after[1] == pytest.approx(before[1], rel=0.02, abs=0.011)
