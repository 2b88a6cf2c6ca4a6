"""The Python of the how-to pages runs as it stands."""

from __future__ import annotations

import re

import pytest

from tests.conftest import ROOT

HOWTO = ROOT / "docs" / "howto"
RUN = ("extend", "loop", "own_plant", "meshcat", "scenario", "logs_elsewhere")


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


def test_the_reference_lists_every_output_and_every_key_of_an_impact():
    from drake_racket import OUTPUTS, ImpactResult
    from drake_racket.results.outputs import USUAL_OUTPUTS
    from manual.results import outputs_page, results_page

    page = outputs_page()
    for output in OUTPUTS.values():
        assert f"| `{output.name}` |" in page
        assert output.long_name in page
    assert "| `peak_hand_force` | N |" in page
    sweeps = (ROOT / "docs" / "sweeps.md").read_text(encoding="utf-8")
    assert all(f"`{name}`" in sweeps for name in USUAL_OUTPUTS)  # what is kept without `outputs`
    numbers = results_page()
    for name in ImpactResult.__dataclass_fields__:
        assert f"| `{name}` |" in numbers or name == "history"
    assert "| `impulse` | N s |" in numbers


def test_the_reference_of_files_has_units_limits_and_meanings():
    from drake_racket import LimbSettings, Scenario
    from manual.schemas import schema_table

    text = schema_table(Scenario)
    assert "| `speed` | m/s | 0.1 to 100 | `25.0` | of the ball, in the world |" in text
    assert "| `support` |  | `free`, `clamped_head`," in text
    assert "| `limb.mass` | kg | 0 to 300 |" in schema_table(LimbSettings, prefix="limb.")


def test_the_command_line_reference_has_every_option():
    from manual.command_line import command_line_page

    page = command_line_page()
    assert "| `--set` | text, several times |" in page
    assert "## drake-racket identify strings" in page
    assert "| `--out` | file or directory | must be given | Directory for the report" in page


def test_every_public_name_has_a_subject():
    from manual.subjects import SUBJECTS, public_names, subject_of

    assert {subject_of(name) for name in public_names()} == set(SUBJECTS)
