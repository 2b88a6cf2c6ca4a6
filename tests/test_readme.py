"""What the README shows works as it stands."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from drake_racket.cases.case import parse_scenario

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str, text: str = README) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def test_scenario():
    (text,) = blocks("yaml")
    scenario = parse_scenario(text)
    assert scenario.tension == "280"
    assert scenario.point_number() == 0


def test_composition_on_a_users_plant():
    code = next(b for b in blocks("python") if "hand_frame" in b)
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    names = {"builder": builder, "plant": plant, "hand_frame": plant.world_frame()}
    exec(code, names)
    assert names["impact"].contact is not None
    builder.Build()


def test_many_cases(capsys):  # the page that the README leads to
    page = (ROOT / "docs" / "howto" / "loop.md").read_text(encoding="utf-8")
    code = next(b for b in blocks("python", page) if "make_impact_diagram" in b)
    exec(code, {})
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list("123456789")
    assert all(line.endswith("[]") for line in lines)  # no warnings


@pytest.mark.parametrize("link", sorted(set(re.findall(r"(?:\]\(|src=\")([\w./-]+)[)\"]", README))))
def test_links_lead_somewhere(link):
    assert (ROOT / link).exists()


def test_it_keeps_to_two_screens():
    assert len(README.splitlines()) <= 105  # the front page's screen, and one more
