"""The Python of the how-to pages runs as it stands."""

from __future__ import annotations

import re

import pytest

from tests.conftest import ROOT

HOWTO = ROOT / "docs" / "howto"
RUN = ("extend", "own_plant", "meshcat", "scenario", "logs_elsewhere")


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def test_pages_with_python_are_run_here():
    with_python = {p.stem for p in HOWTO.glob("*.md") if blocks(p.read_text("utf-8"), "python")}
    assert with_python == set(RUN)


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN)
def test_python_runs(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = (HOWTO / f"{page}.md").read_text(encoding="utf-8")
    if page == "scenario":
        (scenario,) = blocks(text, "yaml")
        (tmp_path / "my_scenario.yaml").write_text(scenario, encoding="utf-8")
    if page == "logs_elsewhere":
        _write_logs(tmp_path / "result")
    for number, code in enumerate(blocks(text, "python")):
        if "import opensim" in code:
            pytest.importorskip("opensim")
        exec(compile(code, f"{page}.md, block {number}", "exec"), {"__name__": "page"})
    if page == "extend":
        assert "the ball leaves at 13.4 m/s" in capsys.readouterr().out


def _write_logs(directory):
    import drake_racket as dr

    history = dr.simulate(dr.Scenario(after=0.005)).history
    directory.mkdir()
    for suffix in ("nc", "csv", "parquet", "sto"):
        dr.write_history(history, directory / f"impact.{suffix}")


def test_errors_are_printed_in_the_form_that_the_reference_shows():
    import drake_racket as dr

    page = (ROOT / "docs" / "reference" / "errors.md").read_text(encoding="utf-8")
    with pytest.raises(dr.InputError) as raised:
        dr.simulate(dr.Scenario(speed=300.0))
    assert f"drake-racket: {raised.value}" in page
