"""Makes the reference of results: JSON keys, outputs of sweeps, log variables, parameter keys."""

from __future__ import annotations

from drake_racket import OUTPUTS, ImpactResult, load_ball, load_grip, load_racket
from drake_racket.io import units
from drake_racket.parameters.overrides import parameter_keys
from drake_racket.results.energy import STORES, Balance
from drake_racket.results.impact import RESULT_UNITS
from manual.schemas import descriptions
from manual.tables import code, table, unit


def results_page() -> str:
    """Makes the page of what `--json` prints and an ImpactResult holds."""
    told = descriptions(ImpactResult)
    names = [name for name in ImpactResult.__dataclass_fields__ if name != "history"]
    rows = [(code(name), unit(RESULT_UNITS.get(name, "")), told.get(name, "")) for name in names]
    meanings = _balance()
    stores = [(code(name), meanings.get(name, "")) for name in STORES]
    return (
        _RESULTS
        + table(("key", "unit", "what"), rows)
        + "\n## `balance`\n\nEnergies at the end of the run, in J"
        " ([how they are counted](../model.md#energy-and-momentum)):\n\n"
        + table(("store", "what"), stores)
        + "\nand the momenta `linear_momentum`, `ball_momentum`, `impulse_on_ball` (N s) and"
        " `angular_momentum` (N m s, about the world's origin), each with three components.\n"
    )


_RESULTS = """# Numbers of an impact

`drake-racket impact --json` prints these keys, `--out` writes them to `impact.json`, and in Python
they are the attributes of [`ImpactResult`](python/run.md#drake_racket.ImpactResult). All are in SI
units and radians, in the racket's initial frame R; the key `units` repeats the units. A number that
does not exist is `null`: without an audit, without contact, without a history.

"""


def _balance() -> dict[str, str]:
    """What the docstring of Balance says of each energy."""
    text = " ".join((Balance.__doc__ or "").split())
    found: dict[str, str] = {}
    marks = sorted((text.find(f"{n}: "), n) for n in STORES if f"{n}: " in text)
    ends = [place for place, _ in marks[1:]] + [len(text)]
    for (place, name), end in zip(marks, ends, strict=True):
        said = text[place + len(name) + 2 : end].strip().rstrip(".;")
        found[name] = said.split(" lost_*: ")[0]
    for name in STORES:
        if name.startswith("lost_"):
            what = {
                "ball": "in the ball's damper, and what compression was left at release",
                "friction": "to friction between ball and strings",
                "joint": "in the dampers of the frame's joints",
                "strings": "in damped strings",
                "limb": "in the limb's dampers and joint limits",
            }
            found[name] = f"lost so far {what[name.removeprefix('lost_')]}"
    return found


def outputs_page() -> str:
    """Makes the page of what a sweep can keep."""
    needs = {
        "audit": "`audit: true`",
        "hand": "support `grip` or `limb`",
        "limb": "support `limb`",
        "surface": "`contact: surface`",
        "element": "`contact: surface` or `friction_reading: element`",
    }
    rows = []
    for output in OUTPUTS.values():
        wants = [needs[output.needs]] if output.needs else []
        wants += ["the history"] if output.needs_history else []
        rows.append((code(output.name), unit(output.units), output.long_name, ", ".join(wants)))
    return (
        "# Outputs of a sweep\n\nNames for `outputs` in a [sweep's file](sweep_file.md). Without"
        " any, the first five are kept. Outputs that need the history make a case about three times"
        " as long. Without what it needs, an output is NaN.\n\n"
        + table(("output", "unit", "what", "needs"), rows)
    )


def parameter_keys_page() -> str:
    """Makes the page of all numbers that `overrides`, `--set` and sweeps can change."""
    keys = parameter_keys(load_racket("tour", "low"), load_ball(), load_grip())
    rows = [(code(key), unit(found.unit), f"{found.value:g}") for key, found in keys.items()]
    return (
        "# Parameter keys\n\nEvery number of racket, ball and grip that a scenario's `overrides`,"
        " `--set KEY=VALUE` and the axes of a sweep can change, with its value in the tour racket"
        " at low tension, the shipped ball and the normal grip. Other files have other members"
        " (`k5`, springs of a larger grid): `drake_racket.parameter_keys` lists those of yours.\n\n"
        + table(("key", "unit", "value"), rows)
    )


def units_page() -> str:
    """Makes the page of all units that are understood, from the table that converts them."""
    rows = []
    for own in units._FACTORS:
        spellings = list(units._FACTORS[own]) + list(units._MULTIPLES.get(own, {}))
        rows.append((code(own), ", ".join(code(text) for text in dict.fromkeys(spellings))))
    rows += [
        (code(own), ", ".join(code(text) for text in others))
        for own, others in units._MULTIPLES.items()
        if own not in units._FACTORS
    ]
    return _UNITS + table(("kept in", "also understood"), rows)


_UNITS = """# Units

Inside, everything is in SI units and radians. On the command line and in files, a number without a
unit is in the unit of its key: m, kg, s, N, m/s; angles are in **degrees** where the key ends in
`_deg` or the option is an angle. Any other unit is written behind the number, with or without a
blank: `speed: 69mph`, `--set racket.head.mass=170g`, `tension: 63lb`. In CSV files the unit stands
in the header: `force [kN]`. A unit that is not in this table is refused, not guessed.

"""
