"""What to cite: the software and the paper always, and the sources of a case's numbers."""

from __future__ import annotations

import dataclasses
import json
import re
import sys

import pytest
import yaml

import drake_racket as dr
from drake_racket.cases.citations import Reference
from drake_racket.cli import main
from drake_racket.parameters.quantities import sourced_fields
from tests.conftest import ROOT


def keys(found: tuple[dr.Citation, ...]) -> list[str]:
    return [c.reference.key for c in found if c.reference is not None]


def test_software_paper_and_drake_always():
    assert keys(dr.citations()) == ["drake_racket", "glynn2011", "drake"]
    assert all(c.numbers == () for c in dr.citations())


def test_every_printed_number_has_its_reference():
    scenario = dr.Scenario(support="limb", grip_kind="weld")
    found = dr.citations(scenario)
    assert keys(found) == ["drake_racket", "glynn2011", "drake", "deleva1996", "aaos1965"]
    cited = {key for citation in found for key in citation.numbers}
    for name, thing in (
        ("racket", dr.load_racket()),
        ("ball", dr.load_ball()),
        ("limb", dr.load_upper_limb()),
    ):
        for key, value in sourced_fields(thing, name):
            assert value.status != "printed" or key in cited, key
    assert not [c for c in found if c.reference is None]


def test_a_welded_hand_has_no_grip_and_a_users_source_is_named(tmp_path):
    mine = dr.racket_from_specs(
        "mine", mass="320g", balance="33cm", swingweight="320", head="98in2"
    )
    dr.write_racket(mine, tmp_path / "mine.yaml")
    found = dr.citations(dr.Scenario(racket=str(tmp_path / "mine.yaml")))
    assert "twu" in keys(found)
    others = [c for c in found if c.reference is None]
    assert others
    assert all(c.numbers and c.source for c in others)


def test_a_ball_that_spins_brings_the_source_of_its_surface():
    assert "twu" not in keys(dr.citations(dr.Scenario()))
    found = dr.citations(dr.Scenario(contact="surface"))
    assert "twu" in keys(found)
    (twu,) = (c for c in found if keys((c,)) == ["twu"])
    assert "ball.surface.tangential_damping" in twu.numbers


def test_citation_file_and_references_agree():
    cff = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    paper = next(c.reference for c in dr.citations() if keys((c,)) == ["glynn2011"])
    (printed,) = cff["references"]
    assert paper.doi == printed["doi"]
    assert paper.title == printed["title"]
    assert (paper.volume, paper.number) == (str(printed["volume"]), str(printed["issue"]))
    assert paper.pages == f"{printed['start']}-{printed['end']}"
    assert f"{paper.where} {paper.volume}({paper.number}):{paper.pages}. doi:" in paper.text()
    plain = dataclasses.replace(paper, volume="", number="", pages="", doi="", where="A place")
    assert plain.text().endswith(f". {paper.title}. A place.")
    assert [a.split(",")[0] for a in paper.authors] == [
        a["family-names"] for a in printed["authors"]
    ]


def run(monkeypatch, capsys, *arguments: str) -> str:
    monkeypatch.setattr(sys, "argv", ["drake-racket", "cite", *arguments])
    main()
    return capsys.readouterr().out


def test_the_command_prints_lines_entries_and_json(monkeypatch, capsys):
    text = run(monkeypatch, capsys)
    assert "doi:10.1007/s12283-010-0056-x" in text
    assert "With a scenario file" in text
    entries = run(monkeypatch, capsys, "backhand", "--bibtex")
    assert re.findall(r"^@(\w+)\{(\w+),$", entries, re.MULTILINE) == [
        ("software", "drake_racket"),
        ("article", "glynn2011"),
        ("misc", "drake"),
        ("article", "deleva1996"),
        ("book", "aaos1965"),
    ]
    assert entries.count("{") == entries.count("}")
    assert "author = {{American Academy of Orthopaedic Surgeons}}" in entries
    assert len(json.loads(run(monkeypatch, capsys, "--racket", "tour", "--json"))) == 3


def test_a_wrong_file_is_one_line(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["drake-racket", "cite", "--racket", "golf"])
    with pytest.raises(SystemExit) as stopped:
        main()
    assert stopped.value.code == 2
    assert "golf" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("changes", "cited"),
    [
        ({"support": "grip", "grip_kind": "hand"}, True),
        ({"support": "limb", "grip_kind": "compliant"}, True),
        ({"support": "grip", "grip_kind": "weld"}, False),
        ({"support": "free"}, False),
    ],
)
def test_a_grips_numbers_are_cited_where_it_holds(changes, cited):
    found = dr.citations(dr.Scenario(grip="hand_medium", **changes))
    numbers = {key for citation in found for key in citation.numbers}
    assert any(key.startswith("grip.") for key in numbers) == cited


def test_references_with_and_without_their_parts():
    whole = Reference("a", "article", ("B, C", "D"), "T", (), "J", "1", "2", "3-4", 1999, "x", "u")
    assert whole.text() == "B, C; D (1999). T. J 1(2):3-4. doi:x."
    assert "author = {B, C and {D}}" in whole.bibtex()
    assert "pages = {3--4}" in whole.bibtex()
    bare = Reference("a", "misc", ("D",), "T", where="J", url="u")
    assert bare.text() == "D. T. J. u."
    assert "year" not in bare.bibtex()
    assert "volume" not in bare.bibtex()
