"""Numbers in the text of a tutorial are those that its cells hold or print."""

from __future__ import annotations

import json
import re

import pytest

from drake_racket.parameters.scenario import Scenario
from tests.conftest import ROOT
from tests.manual.quotes import model

NOTEBOOKS = sorted((ROOT / "docs" / "tutorials").glob("*.ipynb"))
NUMBER = r"(?<![\w.])[-+]?\d+\.?\d*(?:e[-+]?\d+)?"
SCALES = (1.0, 100.0, 1e3, 1e-3)  # as printed, in %, in thousandths and thousands
ELSEWHERE = [
    Scenario().speed,
    254.0,  # N: the tour racket's low tension
    round(model("modes.tour.out_of_plane"), -1),
    90.0,  # degrees: a quarter turn
]


def printed(cell: dict) -> str:
    """The source of a cell of code, and what it printed."""
    texts = ["".join(cell["source"])]
    for output in cell.get("outputs", []):
        texts.append("".join(output.get("text", [])))
        texts += ["".join(t) for kind, t in output.get("data", {}).items() if "text" in kind]
    return "\n".join(texts)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_numbers_in_the_text(path):
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    code = "\n".join(printed(cell) for cell in cells if cell["cell_type"] == "code")
    known = [abs(float(x)) for x in re.findall(NUMBER, code)] + ELSEWHERE
    text = "\n".join("".join(c["source"]) for c in cells if c["cell_type"] == "markdown")
    text = re.sub(r"`[^`]*`|\((?:http|\.\.)[^)]*\)", "", text)
    said = re.findall(r"(?<![\w.])(\d+(?:\.(\d+))?)(?!\w)", text)
    assert said
    for number, decimals in said:
        rounded = {round(k * scale, len(decimals)) for k in known for scale in SCALES}
        assert any(abs(float(number) - r) < 1e-9 for r in rounded), number
