"""The plot command: what it draws from a log alone, what it says is missing, what it refuses."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray

from drake_racket import IntegratorSettings, Scenario, simulate
from drake_racket.cli.plot import labels
from drake_racket.io.shipped import data_directory
from drake_racket.plots.log.contact_force import contact_force_figure
from drake_racket.plots.log.energy import energy_figure
from drake_racket.plots.log.impact import near_contact
from drake_racket.plots.log.overlay import overlay_figure
from drake_racket.plots.log.string_map import snapshots, spring_ends, string_map_figure
from drake_racket.plots.log.vibration import amplitude_spectrum, vibration_figure
from drake_racket.results.formats import racket_of, write_history
from drake_racket.results.history import after_release
from tests.conftest import SPRINGS

FIGURES = {"contact_force", "string_map", "energy", "vibration", "loads"}


@pytest.fixture(scope="module")
def history(tmp_path_factory):
    """An impact on a user's racket in a hand; the racket's file is gone afterwards."""
    file = tmp_path_factory.mktemp("racket") / "mine.yaml"
    shutil.copy(data_directory() / "tour_low.yaml", file)
    coarse = IntegratorSettings(accuracy=1e-3)
    case = Scenario(racket=str(file), support="grip", point="6", after=0.0245, integrator=coarse)
    log = simulate(case).history
    file.unlink()
    return log


@pytest.fixture(scope="module")
def log(history, tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "impact.nc"
    write_history(history, path)
    return path


@pytest.fixture
def run(run):
    """As the folder's, with paths among the arguments."""
    return lambda *arguments: run(*map(str, arguments))


# --- the command ----------------------------------------------------------------------------------


def test_every_figure_from_the_log_alone(run, log, tmp_path):
    out = tmp_path / "new" / "figures"
    status, text, error = run("plot", log, "--out", out)
    assert (status, error) == (0, "")
    assert {path.name for path in out.iterdir()} == {f"{name}.png" for name in FIGURES}
    for path in out.iterdir():
        assert path.read_bytes().startswith(b"\x89PNG\r\n\x1a\n")
        assert f"wrote {path}" in text.replace("\n", "")


def test_what_a_log_lacks_is_said(run, history, tmp_path):
    # a CSV has no racket; this one has no energies, no hand, and no accelerations (discrete plant)
    hand = [name for name in history if name.startswith(("hand_", "grip_"))]
    poor = history.drop_vars(["energy", *hand])
    poor["handle_acceleration"] = history["handle_acceleration"] * np.nan
    poor["handle_acceleration"].attrs = history["handle_acceleration"].attrs
    write_history(poor, tmp_path / "poor.csv")
    out = tmp_path / "out"
    status, text, error = run("plot", tmp_path / "poor.csv", "--out", out, "--format", "svg")
    assert (status, error) == (0, "")
    assert [path.name for path in out.iterdir()] == ["contact_force.svg"]
    said = [line for line in text.splitlines() if line.startswith("no ")]
    assert [line.split(":")[0] for line in said] == [
        "no string_map",
        "no energy",
        "no vibration",
        "no spin",
        "no loads",
    ]


def test_a_ball_that_misses(run, history, tmp_path):
    hand = [name for name in history if name.startswith(("hand_", "grip_"))]
    before = history.isel(time=history["time"] < 0.0).drop_vars(hand)
    write_history(before, tmp_path / "miss.nc")
    out = tmp_path / "out"
    status, text, error = run("plot", tmp_path / "miss.nc", "--out", out, "--format", "svg")
    assert (status, error) == (0, "")
    for name in ("contact_force", "string_map"):
        assert f"no {name}: the ball did not touch the strings" in text
    assert [path.name for path in out.iterdir()] == ["energy.svg"]


def broken(history, how):
    if how == "no force":
        return history.drop_vars("normal_force")
    if how == "other units":
        changed = history.copy()
        changed["normal_force"] = changed["normal_force"].assign_attrs(units="kN")
        return changed
    if how == "other axes":
        return history.assign_coords(axis=["x", "y", "w"])
    return history.assign_attrs(racket='{"name": "cut off"')


@pytest.mark.parametrize(
    ("how", "told"),
    [
        ("no force", "normal_force: got 'nothing'"),
        ("other units", "normal_force: got 'kN'; allowed: units N"),
        ("other axes", "axis"),
        ("broken racket", "racket"),
    ],
)
def test_logs_that_are_refused(run, history, tmp_path, how, told):
    path = tmp_path / "log.nc"
    write_history(broken(history, how), path)
    status, text, error = run("plot", path, "--out", tmp_path / "out")
    assert (status, text, error.count("\n")) == (2, "", 1)
    assert told in error
    assert not (tmp_path / "out").exists()


def test_arguments_that_are_refused(run, log, tmp_path):
    other = tmp_path / "map.nc"
    xarray.Dataset({"restitution": ("point", np.ones(9))}).to_netcdf(other, engine="h5netcdf")
    blocked = tmp_path / "file"
    blocked.write_text("mine", encoding="utf-8")
    out = tmp_path / "out"
    for arguments, told in (
        ((other, "--out", out), "a history: variables over time"),
        ((tmp_path / "none.nc", "--out", out), "a readable file"),
        ((tmp_path, "--out", out), "allowed: nc, csv, parquet, sto"),
        ((log, "--out", out, "--format", "gif"), "--format: got 'gif'; allowed: png, pdf, svg"),
        ((log, "--out", blocked), "--out: got "),
    ):
        status, text, error = run("plot", *arguments)
        assert (status, text, error.count("\n")) == (2, "", 1), told
        assert told in error
    assert not out.exists()
    assert blocked.read_text(encoding="utf-8") == "mine"


# --- the figures ----------------------------------------------------------------------------------


def test_springs_end_on_the_rim(history):
    """Rim springs end on the ellipse, in the line of their string; the others are one spacing."""
    racket = racket_of(history)
    bed = racket.string_bed
    centre = racket.handle.length.value + bed.gsc.value
    ends = spring_ends(racket)
    for (name, (_, second)), (first_end, second_end) in zip(SPRINGS.items(), ends, strict=True):
        vector = second_end - first_end
        if second:
            assert np.abs(vector).max() == pytest.approx(0.0685), name
        else:
            x, y = second_end[0] - centre, second_end[1]
            a, b = bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
            assert (x / a) ** 2 + (y / b) ** 2 == pytest.approx(1.0, abs=1e-12), name
            side = {"tip": (1, 0), "throat": (-1, 0), "left": (0, 1), "right": (0, -1)}
            assert tuple(np.sign(vector)) == side[name.split("-")[0]], name
        assert np.abs(vector).min() == 0.0, name  # along x or y


def test_snapshots(history):
    time, force = history["time"].to_numpy(), history["normal_force"].to_numpy()
    found = dict(snapshots(history))
    assert list(found) == ["half-way to peak force", "peak force", "release", "after"]
    half = 0.5 * time[found["peak force"]]
    assert time[found["half-way to peak force"]] == pytest.approx(half, abs=1e-4)
    assert force[found["peak force"]] == force.max()
    assert force[found["release"] - 1] > 0.0
    assert not force[found["release"] :].any()
    assert time[found["after"]] - time[found["release"]] == pytest.approx(2e-3, abs=1e-4)
    cut = history.isel(time=slice(0, found["peak force"] + 1))
    assert [name for name, _ in snapshots(cut)] == [
        "half-way to peak force",
        "peak force",
        "end of the log, in contact",
    ]


def test_string_map_colours_and_numbers(history):
    """The springs beside the struck point are the darkest, and lie where that point is drawn."""
    figure = string_map_figure(history)
    panel = figure.axes[1]  # at peak force
    (lines,) = panel.collections
    index = dict(snapshots(history))["peak force"]
    tension = history["string_tension"].isel(time=index).to_numpy()
    lightness = lines.get_colors()[:, :3] @ [0.299, 0.587, 0.114]
    assert int(np.argmin(lightness)) == int(np.argmax(tension))
    assert np.array_equal(np.argsort(-tension)[:3], np.argsort(lightness)[:3])
    # point 6 is right of the centre (-y) as seen from the ball, and the ring is there
    ends = np.array(lines.get_segments()[int(np.argmax(tension))])
    assert np.abs(ends - [68.5, 511.0]).sum(axis=1).min() < 1e-6
    deflection = 1e3 * float(history["string_deflection"].isel(time=index).sel(point=6))
    texts = {text.get_position(): text.get_text() for text in panel.texts}
    at = min(texts, key=lambda place: abs(place[0] - 68.5) + abs(place[1] - 511.0))
    assert float(texts[at]) == pytest.approx(deflection, abs=0.051)
    assert "force 0 N" in figure.axes[2].get_title()


def test_area_is_the_energy_lost_in_the_ball(history):
    """The integral of force over compression against the meter of the run."""
    loop = contact_force_figure(history).axes[1]
    shown = float(loop.get_title().rsplit(":", 1)[1].removesuffix(" J"))
    lost = float(history["energy"].sel(store="lost_ball")[-1])
    assert shown == pytest.approx(lost, abs=0.011)


def test_spectrum_of_a_known_vibration():
    """Amplitude and frequency of two sines with a trend, at uneven steps, far from both lines."""
    random = np.random.default_rng(3)
    time = np.cumsum(random.uniform(1e-6, 6e-5, 2000))
    values = 400.0 * np.sin(2 * np.pi * 131.7 * time) + 30.0 * np.cos(2 * np.pi * 447.0 * time)
    lines, amplitudes = amplitude_spectrum(time, values + 500.0 * time - 20.0)
    assert lines[1] < 0.2 / (time[-1] - time[0])
    for low, high, frequency, amplitude in ((80, 200, 131.7, 400.0), (380, 520, 447.0, 30.0)):
        part = (lines > low) & (lines < high)
        top = int(np.argmax(amplitudes[part]))
        assert lines[part][top] == pytest.approx(frequency, abs=1.0)
        assert amplitudes[part][top] == pytest.approx(amplitude, rel=0.01)


def test_fundamentals_are_marked_where_they_hold(history):
    spectrum = vibration_figure(history).axes[1]
    length = float(history["time"][-1]) - float(
        history["time"][dict(snapshots(history))["release"]]
    )
    assert f"resolution {1.0 / length:.0f} Hz" in spectrum.get_title()
    labels = [line.get_label() for line in spectrum.lines]
    assert "free frame, out of plane: 128.5 Hz" in labels
    assert "free frame, in plane: 154.6 Hz" in labels
    scenario = history.attrs["scenario"].replace('"grip"', '"clamped_handle"', 1)
    other = vibration_figure(history.assign_attrs(scenario=scenario)).axes[1]
    assert not [x for x in other.lines if str(x.get_label()).startswith("free frame")]


def test_a_log_too_short_for_a_spectrum(history):
    figure = vibration_figure(history.isel(time=history["time"] < 0.01))
    (axes,) = figure.axes
    assert axes.get_title().startswith("no spectrum: the log ends ")


@pytest.mark.parametrize("strings", [0.0, 2000.0])
def test_how_much_of_the_ringing_is_the_frames(history, strings):
    """The share in the note is that of the spectrum's lines below 300 Hz.

    At half the grip the frame rings louder than the strings; at their 445 Hz more is added.
    """
    louder = strings * np.sin(2.0 * np.pi * 445.0 * history["time"])
    history = history.assign(handle_acceleration=history["handle_acceleration"] + louder)
    spectrum = vibration_figure(history).axes[1]
    (note,) = [text.get_text() for text in spectrum.texts]
    ringing = after_release(history)
    time = ringing["time"].to_numpy()
    kept = np.append(np.diff(time) > 0.0, True)
    values = ringing["handle_acceleration"].sel(axis="z").to_numpy()[kept]
    lines, amplitudes = amplitude_spectrum(time[kept], values)
    power = amplitudes**2
    share = 100.0 * np.sqrt(power[lines <= 300.0].sum() / power.sum())
    assert f"below 300 Hz, the frame's band: {share:.0f} % of the RMS" in note
    top = lines[int(np.argmax(amplitudes))]
    assert (f"undamped strings dominate near {top:.0f} Hz" in note) == bool(strings)
    assert (400.0 < top < 500.0) == bool(strings)


def test_energy_on_one_axis_that_stretches_the_contact(history):
    figure = energy_figure(history)
    for axes in figure.axes:
        to_screen = axes.transData
        left, turn, right = (to_screen.transform((t, 0.0))[0] for t in _turns(history))
        assert turn - left == pytest.approx(right - turn, rel=1e-6)
        assert "narrower beyond" in axes.get_xlabel()


def _turns(history):
    time, near = near_contact(history)
    return time[0], time[near][-1], time[-1]


def test_several_logs_over_each_other(run, log, history, tmp_path):
    other = tmp_path / "second" / "impact.nc"
    other.parent.mkdir()
    louder = history.copy()
    louder["normal_force"] = 2.0 * history["normal_force"]
    louder["normal_force"].attrs = history["normal_force"].attrs
    write_history(louder, other)
    status, _, error = run("plot", log, other, "--out", tmp_path / "out")
    assert (status, error) == (0, "")
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["overlay.png"]
    assert labels([log, other]) == [log.parent.name, "second"]
    figure = overlay_figure({"one": history, "two": louder})
    first, second = figure.axes[0].lines
    assert second.get_ydata().max() == 2.0 * first.get_ydata().max()
    hand = figure.axes[3].lines[0].get_ydata()
    expected = np.linalg.norm(history["hand_force"].to_numpy(), axis=1)
    np.testing.assert_array_equal(hand, expected)
    assert [t.get_text() for t in figure.legends[0].get_texts()] == ["one", "two"]


def test_the_same_log_twice_is_refused(run, log, tmp_path):
    status, text, error = run("plot", log, log, "--out", tmp_path / "out")
    assert (status, text) == (2, "")
    assert "each log once" in error


def test_nothing_refers_to_a_file_of_the_run(history):
    """The fixture removed it; the log names it all the same."""
    assert '"racket": "' in history.attrs["scenario"]
    named = history.attrs["scenario"].split('"racket": "')[1].split('"')[0]
    assert not Path(named).exists()
