"""Every block of docs/your_arm.md runs: files are written, Python and commands are executed."""

from __future__ import annotations

import re
import sys

import pytest

from drake_racket import cli
from drake_racket.cases.case import load_scenario
from tests.conftest import ROOT

PAGE = (ROOT / "docs" / "your_arm.md").read_text(encoding="utf-8")
FILES = re.findall(r"`([\w.]+)`:\n\n```(?:xml|yaml)\n(.*?)```", PAGE, re.DOTALL)
CODE = re.findall(r"^## (.*?)$|```python\n(.*?)```", PAGE, re.DOTALL | re.MULTILINE)
COMMANDS = re.findall(r"```console\ndrake-racket (.*?)\n```", PAGE)


def python_blocks() -> list:
    """Each block with the heading above it as its name; each stands alone."""
    blocks, heading, count = [], "", 0
    for title, code in CODE:
        if title:
            heading, count = title.lower().replace(" ", "_"), 0
        else:
            count += 1
            blocks.append(pytest.param(code, id=f"{heading}-{count}"))
    return blocks


@pytest.fixture
def in_files(tmp_path, monkeypatch):
    for name, text in FILES:
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_nothing_of_the_page_is_left_out():
    assert len(re.findall(r"^```\w", PAGE, re.MULTILINE)) == (
        len(FILES) + len(COMMANDS) + len(python_blocks())
    )
    assert [name for name, _ in FILES] == [
        "arm.urdf",
        "swing.yaml",
        "turned_grip.dmd.yaml",
        "forehand.yaml",
        "mujoco_swing.yaml",
        "arm.xml",
    ]


@pytest.mark.parametrize("code", python_blocks())
def test_python_blocks(code, in_files, capsys):
    exec(compile(code, "docs/your_arm.md", "exec"), {})
    out = capsys.readouterr().out
    assert "nan" not in out
    assert bool(out) == ("print(" in code)
    if "limits_{i}" in code:  # two players: only the second is hit, as its comment says
        assert out.strip() == "[0, 1]"


@pytest.mark.parametrize(
    "command",  # the shipped limb's scenario runs in Python, too
    [pytest.param(c, marks=pytest.mark.slow if "forehand" in c else []) for c in COMMANDS],
)
def test_commands(command, in_files, monkeypatch, capsys):
    name = command.split()[1]
    scenario = load_scenario(in_files / name)
    assert scenario.support == "limb"
    monkeypatch.setattr(sys, "argv", ["drake-racket", *command.split()])
    cli.main()
    captured = capsys.readouterr()
    assert "warning" not in captured.out
    assert captured.err == ""
    assert (in_files / command.split()[-1] / "impact.nc").is_file()


@pytest.mark.parametrize("link", sorted(set(re.findall(r"\]\(#([\w-]+)\)", PAGE))))
def test_links_lead_to_headings(link):
    titles = re.findall(r"^## (.*)$", PAGE, re.MULTILINE)
    assert link in [title.lower().replace(" ", "-") for title in titles]
