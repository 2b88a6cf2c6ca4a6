"""A path may be a text wherever a public function takes one; a keyword is checked by name."""

from __future__ import annotations

import ast
import dataclasses
from pathlib import Path

import pytest

import drake_racket as dr
from drake_racket.identify import read_restitution
from drake_racket.results.formats import read_history, write_history
from drake_racket.sweep import make_sweep, run_sweep
from tests.conftest import ROOT

PACKAGE = ROOT / "drake_racket"
FACES = sorted(PACKAGE.rglob("__init__.pyi"))


def public_functions() -> list[tuple[str, ast.FunctionDef]]:
    """Functions that a face names, wherever they stand."""
    found = []
    for face in FACES:
        for node in ast.walk(ast.parse(face.read_text())):
            if not isinstance(node, ast.ImportFrom) or node.module is None:
                continue
            module = face.parent / Path(*node.module.split(".")).with_suffix(".py")
            names = {alias.name for alias in node.names}
            for item in ast.parse(module.read_text()).body:
                if isinstance(item, ast.FunctionDef) and item.name in names:
                    found.append((item.name, item))
    return found


@pytest.mark.parametrize(
    ("name", "function"), public_functions(), ids=lambda x: x if isinstance(x, str) else ""
)
def test_where_a_path_goes_a_text_goes(name, function):
    for argument in (*function.args.args, *function.args.kwonlyargs):
        annotation = ast.unparse(argument.annotation) if argument.annotation else ""
        if "Path" in annotation and "Callable" not in annotation:
            assert "str" in annotation, f"{name}: {argument.arg}: {annotation}"


def test_texts_work(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("s.yaml").write_text("after: 0.001\n")
    rows = "".join(f"{i * 1e-4},{i}\n" for i in range(30))
    Path("f.csv").write_text("time [s],force [N]\n" + rows)
    table = "point,approach_speed [m/s],restitution\n"
    Path("r.csv").write_text(table + "".join(f"{p},{30 + p},0.4\n" for p in range(1, 10)))
    scenario = dr.load_scenario("s.yaml")
    history = dr.simulate(scenario).history
    for suffix in ("nc", "csv", "sto"):
        write_history(history, f"x.{suffix}")
        assert read_history(f"x.{suffix}").sizes["time"] > 10
    assert dr.read_signal("f.csv", "force", "N").value[-1] == 29.0
    assert read_restitution("r.csv")
    dr.write_text("text", "t.txt")
    dr.write_grip(dr.load_grip("normal"), "grip.yaml")
    assert dr.load_grip("grip.yaml") == dr.load_grip("normal")
    dr.check_directory("new", "--out")
    sweep = make_sweep(dataclasses.replace(scenario, audit=False), {"point": [5]}, ["touches"])
    assert run_sweep(sweep, "out")["touches"].item() == 1
    assert Path("out").is_dir()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: dr.Scenario(sped=30.0), ("Scenario: sped", "speed (of racket")),
        (lambda: dr.LimbSettings(joint_torque="hold"), ("LimbSettings", "joint_torques (of")),
        (lambda: dr.Stroke(guess={}), ("Stroke: guess", "guess_deg (of")),
        (lambda: dr.IntegratorSettings(acuracy=1e-4), ("acuracy", "accuracy (of")),
        (lambda: dataclasses.replace(dr.Scenario(), poin="5"), ("poin", "point (of")),
    ],
)
def test_a_wrong_keyword_names_the_near_one(make, words):
    with pytest.raises(dr.InputError) as caught:
        make()
    assert all(word in str(caught.value) for word in words), str(caught.value)
