"""Commands run in this process."""

from __future__ import annotations

import sys

import pytest

from drake_racket import cli


@pytest.fixture
def run(monkeypatch, capsys):
    """Runs cli.main in this process; returns status, standard output and standard error."""

    def call(*arguments: str) -> tuple[object, str, str]:
        monkeypatch.setattr(sys, "argv", ["drake-racket", *arguments])
        status: object = 0
        try:
            cli.main()
        except SystemExit as stop:
            status = stop.code
        out, err = capsys.readouterr()
        return status, out, err

    return call


@pytest.fixture
def run_well(run):
    """As `run`, for what must succeed: returns standard output."""

    def call(*arguments: str) -> str:
        status, out, err = run(*arguments)
        assert (status, err) == (0, "")
        return out

    return call
