"""The blocks of docs/rackets.md and the README's on rackets run as they stand."""

from __future__ import annotations

import re
import shlex
import sys

import pytest

from drake_racket import cli
from tests.conftest import ROOT

PAGE = (ROOT / "docs" / "rackets.md").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")


def commands(text: str) -> list[list[str]]:
    found = []
    for block in re.findall(r"```console\n(.*?)```", text, re.DOTALL):
        for line in block.splitlines():
            if line.startswith("drake-racket "):
                found.append(shlex.split(line, comments=True)[1:])
    return found


def test_python(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(compile(code, "docs/rackets.md", "exec"), {})
    assert (tmp_path / "mine.yaml").is_file()


@pytest.mark.slow
@pytest.mark.parametrize("where", ["page", "readme"])
def test_commands(where, tmp_path, monkeypatch, capsys):
    text = PAGE if where == "page" else README.split("## Your own racket")[1]
    monkeypatch.chdir(tmp_path)
    ran = commands(text)
    assert {command[0] for command in ran} >= {"new", "compare", "customise"}
    for command in ran:
        monkeypatch.setattr(sys, "argv", ["drake-racket", *command])
        try:
            cli.main()
        except SystemExit as stop:
            raise AssertionError(f"{command}: {capsys.readouterr().err}") from stop
    assert (tmp_path / "compare" / "compare.html").is_file()
