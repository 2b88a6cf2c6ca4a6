"""What commands ask of the functions behind them, and what they print of the results.

The functions are stood for: their own tests are elsewhere.
"""

from __future__ import annotations

import inspect
import json
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import typer
import xarray
from rich.console import Console

from drake_racket.animation import AnimationSettings
from drake_racket.cli import app, console, identify, impact, sweep, validate
from drake_racket.cli.identify import run as running
from drake_racket.compare import Swing
from drake_racket.derivatives import Derivatives
from drake_racket.identify.core.estimate import Estimate
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Progress
from drake_racket.store import OtherComputation
from drake_racket.validation import PublishedValue, compare
from drake_racket.validation.outcome import Plan
from tests.compare.test_compare import made as made_assessment
from tests.recorded import check_record
from tests.stand import Stand

RECORDS = Path(__file__).parent / "records"


@pytest.fixture
def stand(monkeypatch: pytest.MonkeyPatch) -> Stand:
    return Stand(monkeypatch)


# ---- options


def options(commands: Any) -> dict[str, Any]:
    """Every option of the commands by name, and what it is without being given."""
    found = {}
    for one in commands.registered_commands:
        parameters = inspect.signature(one.callback).parameters.values()
        found[one.callback.__name__] = {
            p.name: ["required" if p.default is p.empty else _usual(p.default)] for p in parameters
        }
    return found


def _usual(default: Any) -> Any:
    return str(default) if isinstance(default, Path) else default


def test_options_and_what_they_are_without_being_given():
    found = options(app) | {"identify": options(identify.app)}
    check_record(found, RECORDS / "options.json")
    assert AnimationSettings() == AnimationSettings(
        found["animate"]["slowdown"][0],
        found["animate"]["fps"][0],
        found["animate"]["magnify"][0],
        found["animate"]["magnify_strings"][0],
    )
    names = ("swing", "pivot", "ball_speed")
    assert Swing() == Swing(*(found["compare"][name][0] for name in names))


# ---- identify


FITS = {
    "strings": (
        ["tour.csv", "--free", "T0, k1", "--start", "T0=200", "--span", "3", "--starts", "2"],
        "strings.string_bed.fit_string_bed",
        "outputs.write_string_bed",
    ),
    "strings_annealed": (
        [
            "t.csv",
            "--method",
            "annealing",
            "--polish",
            "--temperature",
            "30",
            "--evaluations",
            "9",
            "--keep-repeats",
            "--speed-sigma",
            "0.2",
            "--rescale",
            "--profiles",
            "--select",
            "a=b",
        ],
        "strings.string_bed.fit_string_bed",
        "outputs.write_string_bed",
    ),
    "tension": (
        ["t.csv", "--strung-at", "280N", "--start", "250", "--seed", "3", "--workers", "2"],
        "strings.string_bed.fit_tension",
        "outputs.write_string_bed",
    ),
    "tension_at_least": (
        ["t.csv", "--strung-at", "50"],
        "strings.string_bed.fit_tension",
        "outputs.write_string_bed",
    ),
    "tension_at_most": (
        ["t.csv", "--strung-at", "600"],
        "strings.string_bed.fit_tension",
        "outputs.write_string_bed",
    ),
    "friction": (
        ["t.csv", "--friction-reading", "displacement", "--start", "mu1=0.3", "--keep-repeats"],
        "strings.friction.fit_friction",
        "outputs.write_friction",
    ),
    "friction_of_means": (
        ["t.csv"],
        "strings.friction.fit_friction",
        "outputs.write_friction",
    ),
    "spin": (
        ["t.csv", "--free", "mu,kt", "--start", "mu=0.4", "--name", "mine"],
        "ball.surface.fit_surface",
        "spin.write_surface_fit",
    ),
    "spin_of_all": (["t.csv"], "ball.surface.fit_surface", "spin.write_surface_fit"),
    "ball": (
        ["t.csv", "--mass", "57g", "--speed-low", "18", "--speed-high", "33"],
        "ball.fit.fit_ball",
        "bench.write_ball_fit",
    ),
    "ball_of_the_file": (["t.csv"], "ball.fit.fit_ball", "bench.write_ball_fit"),
    "impacts": (
        ["t.csv", "--free", "ball.mass", "--free", "racket.head.mass = 0.1:0.2", "--starts", "3"],
        "impacts.fit.fit_impacts",
        "impacts.write_impacts",
    ),
}
"""Name -> arguments of `identify`, the fit that it asks, what writes it."""

ESTIMATES = {
    "T0": Estimate(212.3456789, 1.5, (209.0, 215.5), "N"),
    "k1": Estimate(31234.5678, np.inf, (-np.inf, np.inf), "N/m"),
}


class MadeTable(SimpleNamespace):
    """Stands for measurements."""

    def averaged(self) -> MadeTable:
        """The means."""
        return MadeTable(name=f"means of {self.name}")

    def with_speed_sigma(self, sigma: float) -> MadeTable:
        """With another scatter."""
        return MadeTable(name=f"{self.name}, speeds to {sigma:g}")


def fit_of(*_: Any, progress: Any = None, **__: Any) -> SimpleNamespace:
    progress(Progress("profiles", 2, 3, rms=0.0123456))
    result = SimpleNamespace(rms=0.0234567, residual_unit="sd", residual_sigma=1.23456)
    fields = {"estimates": ESTIMATES, "warnings": ["[careful]"], "rms": 0.0345678}
    return SimpleNamespace(**fields, result=result, fields=lambda: ESTIMATES)


@pytest.mark.parametrize("name", FITS)
def test_fits(name, stand, run, tmp_path, monkeypatch):
    arguments, fit, write = FITS[name]
    identify = "drake_racket.identify"
    stand.let(f"{identify}.{fit}", fit_of)
    stand.let(f"{identify}.report.{write}", lambda *_, **__: [Path("a/result.json")])
    for reader in ("strings.restitution_table.read_restitution", "strings.angle_table.read_angles"):
        stand.let(f"{identify}.{reader}", lambda file, select: MadeTable(name=str(file)))
    for reader in ("ball.spins.read_spins", "ball.fit.read_ball_impacts"):
        stand.let(f"{identify}.{reader}", lambda file: MadeTable(name=str(file)))
    data = SimpleNamespace(name="data", sigma=None, outputs=[SimpleNamespace(units="m/s")])
    stand.let(f"{identify}.impacts.table.read_measured_impacts", lambda *_: data)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("drake_racket.cli.identify.run.today", lambda: "2011-01-01")
    for module in ("", ".bench", ".impacts", ".spin"):
        monkeypatch.setattr(f"drake_racket.cli.identify{module}.today", lambda: "2011-01-01")
    command = name.partition("_")[0]
    status, out, err = run("identify", command, *arguments, "--out", "found")
    assert status == 0, err
    found = {"asked": stand.asked, "out": out.splitlines(), "err": err.splitlines()}
    check_record(found, RECORDS / f"{name}.json")


@pytest.mark.parametrize("newtons", ["49.9", "600.1"])
def test_a_tension_that_no_racket_is_strung_at(newtons, run, tmp_path):
    status, _, err = run(
        "identify", "tension", "t.csv", "--strung-at", newtons, "--out", str(tmp_path)
    )
    assert status == 2
    assert "50 to 600 N" in err


def test_a_fit_of_the_frame(stand, run, tmp_path, monkeypatch):
    identify = "drake_racket.identify"
    fit = SimpleNamespace(fields=lambda: ESTIMATES, record_rms=1.23456, warnings=["w"])
    stand.let(f"{identify}.frame.fit.fit_frame", lambda *_, **__: fit)
    stand.let(f"{identify}.frame.fit.read_hammer_record", lambda path: MadeTable(name=str(path)))
    stand.let(f"{identify}.report.bench.write_frame_fit", lambda *_, **__: [Path("racket.yaml")])
    monkeypatch.setattr("drake_racket.cli.identify.bench.today", lambda: "2011-01-01")
    monkeypatch.chdir(tmp_path)
    strikes = ["--in-plane", "a.csv", "--out-of-plane", "b.csv", "--out-of-plane", "c.csv"]
    _, first, _ = run("identify", "frame", "--out", "found", *strikes, "--place", "10cm")
    options = ["--drake-passes", "0", "--starts", "2", "--seed", "5", "--name", "mine"]
    _, second, _ = run("identify", "frame", "--out", "found", *strikes[2:], *options)
    check_record(
        {"asked": stand.asked, "out": [first.splitlines(), second.splitlines()]},
        RECORDS / "frame.json",
    )


def test_a_frame_like_a_whole_racket(stand, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    import drake_racket as dr

    for i, name in enumerate(("", "mine")):
        fit = SimpleNamespace(
            racket=dr.load_racket(),
            families={"A": 2.3456, "B": 1.2345},
            measured={"mass": (0.320, 0.002, 0.325), "balance": (0.33, 0.001, 0.3295)},
            open=lambda i=i: ["k2", "k3"] * i,
            fields=lambda: ESTIMATES,
        )
        stand.let("drake_racket.identify.frame.distribution.fit_distribution", lambda *_, f=fit: f)
        stand.let(
            "drake_racket.identify.report.distribution.write_distribution_fit",
            lambda fit, out: [out / fit.racket.name],
        )
        stand.patch.setattr("dataclasses.replace", replaced)
        given = ["--measured", "mass=320g+-1g", "--measured", "balance = 33cm"]
        _, out, err = run(
            "identify", "distribution", "--out", "found", *given, *["--name", name] * bool(name)
        )
        assert err == ""
        check_record({"asked": stand.asked, "out": out.splitlines()}, RECORDS / f"like_{i}.json")


def replaced(one: Any, **changes: Any) -> Any:
    """As `dataclasses.replace`, of what stands for one, too."""
    import copy

    other = copy.copy(one)
    for key, value in changes.items():
        object.__setattr__(other, key, value)
    return other


@pytest.mark.parametrize(("rms", "shown"), [(0.0123456, "RMS 1.235 %"), (None, "RMS inf %")])
def test_how_far_a_fit_is(rms, shown, monkeypatch, tmp_path):
    from contextlib import contextmanager

    told = []

    @contextmanager
    def showing(describe):
        yield lambda now: told.append(describe(now))

    monkeypatch.setattr(running, "showing", showing)
    with running.running(tmp_path, "%", 100.0) as report:
        report(Progress("fitting", 3, 8, rms=rms))
    assert told == [f"38 % done, {shown}"]


@pytest.mark.parametrize(("kept", "said"), [(True, "goes on from there"), (False, "begins anew")])
def test_what_an_interrupted_fit_leaves(kept, said, tmp_path, capsys):
    with pytest.raises(typer.Exit) as stopped, running.running(tmp_path, "%", kept=kept):
        raise KeyboardInterrupt
    assert stopped.value.exit_code == 130
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("drake-racket: interrupted; ")
    assert line.endswith(said)


@pytest.mark.parametrize(
    ("error", "fresh"),
    [
        (InputError("checkpoint", "a", "b"), True),
        (OtherComputation("out: data", "a", "b"), True),
        (InputError("speed", "a", "b"), False),
    ],
)
def test_a_fit_that_cannot_go_on_may_begin_anew(error, fresh, tmp_path):
    with pytest.raises(InputError) as told, running.running(tmp_path, "%"):
        raise error
    assert told.value.allowed == ("b; or --fresh" if fresh else "b")
    assert told.value.key == error.key


# ---- what else is printed


def test_a_comparison(stand, run, tmp_path):
    parts = {"frequency": {"handle_ringing": 2.0, "mass": 0.001}}
    many = iter(
        [
            made_assessment("tour", {}, mass=0.31, handle_ringing=200.0, swing_best_place=0.02),
            made_assessment("other", parts, mass=0.30, handle_ringing=210.0),
        ]
    )

    def assessed(racket, *, base, swing, progress):
        progress(Progress("impacts", 1, 4))
        return next(many)

    stand.let("drake_racket.compare.spread.assess_with_spread", assessed)
    _, out, err = run("compare", "tour", "recreational", "--speed", "20", "--pivot", "10cm")
    assert err == ""
    check_record({"asked": stand.asked, "out": out.splitlines()}, RECORDS / "compare.json")


def row(verdict: str, model: float, unit: str = "N") -> Any:
    about = {"unit": unit, "source": "s", "note": "n", "tolerance": 0.1}
    more = {"not_comparable": "no"} if verdict == "not comparable" else {"value": 100.0}
    return compare(PublishedValue("k", "force_plate", f"{verdict} q", **about, **more), model)


@pytest.mark.parametrize("given", [[], ["--coarse", "--only", "spin", "--fresh", "--workers", "3"]])
def test_verdicts(given, stand, run_well_but_err, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows = [row("agrees", 101.23456), row("differs", 123.456, "1"), row("not comparable", 3.0)]
    rows.append(row("agrees", 95.0))

    def validated(out, *, only, plan, fresh, progress):
        assert plan == (Plan.coarse(3) if given else Plan(workers=2))
        progress(Progress("Plate", 1, 2))
        return rows

    stand.let("drake_racket.validation.validate", validated)
    out, err = run_well_but_err("validate", "--out", "report", *given)
    assert err == "drake-racket: Plate: 1 of 2\n"
    stand.asked[0][2].pop("plan")
    check_record(
        {"asked": stand.asked, "out": out.splitlines()}, RECORDS / f"validate_{len(given)}.json"
    )


@pytest.fixture
def run_well_but_err(run):
    def call(*arguments: str) -> tuple[str, str]:
        status, out, err = run(*arguments)
        assert status == 0, err
        return out, err

    return call


def colours(print_it: Any, monkeypatch: pytest.MonkeyPatch, module: Any) -> str:
    """What is printed, with its marks."""
    wide = Console(record=True, width=160, force_terminal=True, color_system="standard")
    monkeypatch.setattr(module, "new_console", lambda: wide)
    print_it()
    return wide.export_text(styles=True)


def test_verdicts_have_colours(monkeypatch):
    rows = [row("agrees", 101.0), row("differs", 150.0)]
    text = colours(lambda: validate._print_verdicts(rows, Path("out")), monkeypatch, validate)
    lines = text.splitlines()
    assert "\x1b[32magrees" in lines[1]
    assert "\x1b[33mdiffers" in lines[2]


def test_derivatives_table(monkeypatch):
    outputs = ("rebound_speed", "restitution", "peak_hand_torque", "handle_ringing")
    table = np.arange(1.0, 9.0).reshape(4, 2) / 3.0
    keys, units = ("speed", "contact_share"), ("m/s", "1")
    found = Derivatives(outputs, keys, units, np.zeros(4), table, 1e-6)
    wide = Console(width=120)
    with wide.capture() as said:
        wide.print(impact._derivatives_table(found))
    check_record([line.rstrip() for line in said.get().splitlines()], RECORDS / "derivatives.json")


def test_a_sweeps_end(capsys, tmp_path, monkeypatch):
    for name in ("results.nc", "results.csv"):
        (tmp_path / name).write_text("")
    status = np.array([[0, 1, 1], [1, 2, 0]])
    failures = np.array([["", "lost", "lost"], ["odd", "", ""]])
    data = {"status": (("a", "b"), status), "failure": (("a", "b"), failures)}
    about = {"warnings": json.dumps({"deep [x]": 2}), "comparison": json.dumps({"text": "A > B"})}
    monkeypatch.setattr("drake_racket.sweep.export.result_paths", lambda out: [Path("r.nc")])
    sweep._print_summary(xarray.Dataset(data, attrs=about), tmp_path)
    whole = xarray.Dataset({"status": ("a", [0]), "failure": ("a", [""])}, attrs={"warnings": "{}"})
    sweep._print_summary(whole, tmp_path)
    assert capsys.readouterr().out.splitlines() == [
        "6 cases, 3 failed, 1 missing",
        "failed: 2 x lost",
        "failed: 1 x odd",
        "warning: 2 x deep [x]",
        "A > B",
        "wrote r.nc",
        "1 cases, 0 failed",
        "wrote r.nc",
    ]


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (3.4, "3 s"),
        (59.6, "1 min 00 s"),
        (60, "1 min 00 s"),
        (3599.0, "59 min 59 s"),
        (3600, "1 h 00 min"),
        (7385.0, "2 h 03 min"),
    ],
)
def test_durations(seconds, text):
    assert sweep._duration(seconds) == text


def test_how_far_a_sweep_is():
    assert sweep._text(Progress("checking", 2, 9)) == "2 of 9 cases"
    now = Progress("running", 6, 30, failed=2, before=2, seconds=8.0)
    assert sweep._text(now) == "6 of 30 cases, 2 failed, 0.5 cases/s, 48 s left"
    assert sweep._text(Progress("running", 0, 30)) == "0 of 30 cases"


def test_lines_of_progress(capsys, monkeypatch):
    clock = iter([0.0, 1.0, 2.0, 3.0, 4.0, 8.9, 9.0, 9.1, 20.0, 21.0, 22.0])
    monkeypatch.setattr(console.time, "monotonic", lambda: next(clock))
    with console.showing(lambda now: f"{now.done:g} of {now.total:g}") as report:
        for task, done in (
            *(("running", 0), ("running", 1), ("running", 4), ("writing", 0)),  # at 1, 2, 3, 4 s
            *(("writing", 1), ("writing", 2), ("writing", 3)),  # 8.9, 9.0 (5 s later), 9.1
            *(("fitting", 1), ("fitting", 4), ("running", 4)),  # 20, 21, 22
        ):
            report(Progress(task, done, 4))
    assert [
        line.removeprefix("drake-racket: ") for line in capsys.readouterr().err.splitlines()
    ] == [
        "running: 0 of 4",
        "running: 4 of 4",
        "writing: 0 of 4",
        "writing: 2 of 4",
        "fitting: 1 of 4",
        "running: 4 of 4",
    ]


@pytest.mark.parametrize("quiet", [True, False])
def test_nothing_is_shown_where_no_lines_are_wanted(quiet, capsys):
    with console.showing(str, quiet=quiet, lines=quiet) as report:
        report(Progress("running", 0, 4))
    assert capsys.readouterr().err == ""


class Terminal:
    """A standard error that says it is a terminal."""

    def __init__(self) -> None:
        self.text = ""

    def write(self, text: str) -> int:
        """Keeps it."""
        self.text += text
        return len(text)

    def flush(self) -> None:
        """Does nothing."""

    def isatty(self) -> bool:
        """It is."""
        return True


def test_bars_of_progress_one_a_task(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr(sys, "stderr", Terminal())
    import rich.progress

    added, updated = [], []
    add, update = rich.progress.Progress.add_task, rich.progress.Progress.update

    def adding(self, task, **more):
        added.append((task, more))
        return add(self, task, **more)

    def updating(self, number, **more):
        updated.append((int(number), more))
        return update(self, number, **more)

    monkeypatch.setattr(rich.progress.Progress, "add_task", adding)
    monkeypatch.setattr(rich.progress.Progress, "update", updating)
    with console.showing(lambda now: f"{now.done} so far", lines=False) as report:
        for task, done in (("one", 1), ("one", 2), ("two", 5)):
            report(Progress(task, done, 7))
    assert added == [("one", {"text": ""}), ("two", {"text": ""})]
    assert updated == [
        (0, {"completed": 1, "total": 7, "text": "1 so far"}),
        (0, {"completed": 2, "total": 7, "text": "2 so far"}),
        (1, {"completed": 5, "total": 7, "text": "5 so far"}),
    ]
    assert "two" in sys.stderr.text


def test_what_a_terminal_is_told_while_it_waits(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    with console.working("reading"):
        pass
    assert "reading ..." in sys.stderr.text


def test_an_animation(stand, run, tmp_path):
    scene = SimpleNamespace(time=np.array([-0.001, 0.002, 0.0193]), fps=12.5)
    stand.let("drake_racket.animation.animate", lambda *_, **__: scene)
    stand.let("drake_racket.results.formats.read_history", lambda path: SimpleNamespace(name=path))
    for log in ("impact.nc", "."):
        options = ["--out", "film.gif", "--magnify", "3"] * (log == ".")
        _, out, err = run("animate", log, *(options or ["--out", "page.html"]))
        assert err == ""
        stand.asked.append(out.splitlines())
    check_record(stand.asked, RECORDS / "animate.json")
