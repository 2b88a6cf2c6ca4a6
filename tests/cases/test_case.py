"""A case is complete: resolved once, frozen, told apart by its digest, and no file behind it."""

from __future__ import annotations

import builtins
import dataclasses
import io
import pathlib
import pickle
from typing import Any

import numpy as np
import pytest

from drake_racket import InputError, LimbSettings, Scenario, resolve, simulate
from drake_racket.cases.diagram import make_impact_diagram
from drake_racket.io.shipped import data_directory

SHORT = 0.004


def test_a_case_holds_what_its_scenario_names() -> None:
    case = resolve(
        Scenario(tension="high", overrides={"ball.mass": 0.06, "racket.head.mass": 0.17})
    )
    assert case.racket.string_bed.initial_tension.value == 772.9
    assert (case.ball.mass.value, case.racket.head.mass.value) == (0.06, 0.17)
    assert case.racket.head.mass.status == "inferred"
    assert case.limb is None
    limb = resolve(Scenario(support="limb", limb=LimbSettings(mass=70.0))).limb
    assert limb is not None
    assert limb.subject.mass.value == 70.0


def test_a_case_is_returned_as_it_is() -> None:
    case = resolve(Scenario())
    assert resolve(case) is case


def test_a_case_cannot_be_changed() -> None:
    case = resolve(Scenario())
    with pytest.raises(dataclasses.FrozenInstanceError):
        case.racket.head.mass.value = 1.0  # type: ignore[misc]
    with pytest.raises(dataclasses.FrozenInstanceError):
        case.ball = case.ball  # type: ignore[misc]


CHANGES: list[dict[str, Any]] = [
    {"speed": 25.000000001},
    {"tension": "high"},
    {"support": "clamped_head"},
    {"overrides": {"ball.mass": 0.0590001}},
    {"joint_reading": "as_printed"},
    {"integrator": dataclasses.replace(Scenario().integrator, accuracy=1e-5)},
]


def test_the_digest_tells_cases_apart() -> None:
    digests = [resolve(Scenario(**changes)).digest for changes in ({}, *CHANGES)]
    assert len(set(digests)) == len(digests)
    again = pickle.loads(pickle.dumps(resolve(Scenario())))
    assert again.digest == digests[0]


def test_the_digest_is_of_the_content_of_a_file(tmp_path: pathlib.Path) -> None:
    text = (data_directory() / "tour_low.yaml").read_text(encoding="utf-8")
    path = tmp_path / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    scenario = Scenario(racket=str(path))
    first = resolve(scenario)
    path.write_text(text.replace("value: 0.13350", "value: 0.13351"), encoding="utf-8")
    second = resolve(scenario)
    assert first.digest != second.digest
    assert (first.racket.handle.mass.value, second.racket.handle.mass.value) == (0.1335, 0.13351)


def test_nothing_behind_a_case_opens_a_parameter_file(monkeypatch: pytest.MonkeyPatch) -> None:
    case = resolve(Scenario(support="limb", after=SHORT))
    expected = simulate(case)
    opened: list[str] = []
    real = builtins.open

    def watched(file: Any, *args: Any, **kwargs: Any) -> Any:
        opened.append(str(file))
        return real(file, *args, **kwargs)

    for module in (builtins, io):
        monkeypatch.setattr(module, "open", watched)
    found = simulate(case, make_impact_diagram(case))
    assert [name for name in opened if name.endswith((".yaml", ".yml"))] == []
    np.testing.assert_array_equal(found.rebound_velocity, expected.rebound_velocity)


def test_a_number_that_is_written_as_text_is_refused_in_python() -> None:
    with pytest.raises(InputError, match=r"scenario: speed: got '25'; allowed: a finite number"):
        resolve(Scenario(speed="25"))  # type: ignore[arg-type]


def test_a_wrong_key_names_the_near_one(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "swing.yaml"
    path.write_text("sped: 25\n", encoding="utf-8")
    from drake_racket import load_scenario

    with pytest.raises(
        InputError, match=r"swing\.yaml: sped: got 'an unknown key'; allowed: speed"
    ):
        load_scenario(str(path))


HELD = Scenario(support="grip")


@pytest.mark.parametrize(
    ("base", "changes", "shared"),
    [
        (Scenario(), {"speed": 30.0, "point": "2", "tension": "high"}, True),
        (Scenario(), {"grip_kind": "torsional"}, True),  # nobody holds it
        (Scenario(), {"overrides": {"racket.head.mass": 0.17, "ball.mass": 0.06}}, True),
        (Scenario(), {"limb": LimbSettings(model="other.xml")}, True),
        (HELD, {"overrides": {"grip.torque_stiffness.x": 5.0}}, True),
        (HELD, {"grip": "hand_light"}, False),  # whose hand has a place
        (HELD, {"grip_kind": "torsional"}, False),
        (Scenario(), {"support": "clamped_head"}, False),
        (Scenario(), {"contact": "surface"}, False),
        (Scenario(), {"friction_reading": "element"}, False),
        (Scenario(), {"time_step": 2e-5}, False),
        (Scenario(), {"gravity": (0.0, 0.0, -1.0)}, False),
        (Scenario(), {"audit": False}, False),
        (Scenario(), {"racket": "recreational"}, False),
        (Scenario(), {"overrides": {"racket.handle.length": 0.35}}, False),
        (Scenario(), {"overrides": {"racket.frame.segments": 3}}, False),
    ],
)
def test_which_cases_share_a_diagram(base: Scenario, changes: dict[str, Any], shared: bool) -> None:
    other = dataclasses.replace(base, **changes)
    assert (resolve(base).topology == resolve(other).topology) == shared
