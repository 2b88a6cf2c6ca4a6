"""Animations: what a history carries for them, what is drawn, the files, and a real browser."""

from __future__ import annotations

import base64
import io
import json
import os
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import typer
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from drake_racket import InputError, Scenario, simulate
from drake_racket.animation import AnimationSettings, animate, film
from drake_racket.animation.meshcat_page import meshcat_page
from drake_racket.animation.outline import racket_outline, spring_ends, tube
from drake_racket.animation.scene import make_scene, read_geometry
from drake_racket.animation.settings import check_settings, frame_count
from drake_racket.cli import animate as command
from drake_racket.io.files import write_netcdf
from drake_racket.parameters.limb import load_upper_limb
from drake_racket.plots.style import draw_outline, new_figure
from drake_racket.results.formats import read_history

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
TRUE = AnimationSettings(magnify=1.0, magnify_strings=1.0)


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A hand-held racket that an oblique ball bends, turns and twists, from a file."""
    scenario = Scenario(
        support="grip",
        point="1",
        incidence_deg=30.0,
        after=0.018,
        approach_time=0.002,
        audit=False,
    )
    path = tmp_path_factory.mktemp("animation") / "impact.nc"
    write_netcdf(simulate(scenario).history, path)
    return path


@pytest.fixture(scope="module")
def history(log):
    return read_history(log)


@pytest.fixture(scope="module")
def limb_history():
    scenario = Scenario(support="limb", after=0.002, approach_time=0.0, audit=False)
    return simulate(scenario).history


def scene_of(history, settings=TRUE, frames=80):
    duration = float(np.ptp(history["time"].to_numpy()))
    rate = (frames - 1) / (duration * settings.slowdown)
    return make_scene(history, read_geometry(history), settings, rate, frames)


def logged(history, name, scene):
    values = history[name].to_numpy()
    time = history["time"].to_numpy()
    return np.stack([np.interp(scene.time, time, column) for column in values.T], axis=1)


def test_racket_from_the_log_is_where_drake_had_it(history):
    """Butt, orientation and joint angles give the head's points that Drake logged on its own."""
    scene = scene_of(history)
    g = scene.geometry
    points = scene.head.points(np.array([[g.gsc, 0.0, 0.0], [g.head_length, 0.0, 0.0]]))
    for k, name in enumerate(("gsc_position", "tip_position")):
        np.testing.assert_allclose(points[:, k], logged(history, name, scene), atol=2e-6)
    turned = scene.handle.rotation.magnitude()
    assert turned.max() > 0.1  # the test sees an orientation
    assert np.abs(scene.handle.rotation.as_rotvec()[:, 0]).max() > 0.02  # about its axis as well


def test_string_masses_and_ball_are_true_without_magnification(history):
    scene = scene_of(history)
    np.testing.assert_allclose(scene.strings, logged(history, "string_deflection", scene))
    # the ball's lowest point is where the model has its point mass, and x above it in contact
    lowest = scene.ball.place - scene.ball.rotation.apply([0.0, 0.0, 1.0]) * scene.ball_axes[:, 2:]
    x = np.interp(scene.time, history["time"], history["compression"]).clip(0.0)
    gap = lowest - logged(history, "ball_position", scene)
    np.testing.assert_allclose(np.linalg.norm(gap, axis=1), x, atol=2e-5)
    radius = scene.geometry.ball_radius
    np.testing.assert_allclose(scene.ball_axes.prod(axis=1), radius**3, rtol=1e-12)
    assert x.max() > 0.005


def test_a_ball_that_spins_is_where_its_centre_is_and_its_seam_turns():
    scenario = Scenario(
        contact="surface", incidence_deg=30.0, spin_rpm=3000.0, after=0.008, audit=False
    )
    log = simulate(scenario, engine="compiled").history
    scene = scene_of(log)
    place = logged(log, "ball_position", scene)
    # flattened towards the strings by its compression, which lets its middle go away from them
    x = np.interp(scene.time, log["time"], log["compression"]).clip(0.0)
    assert x.max() > 0.005
    assert np.sum(x == 0.0) > 20
    gap = np.linalg.norm(scene.ball.place - place, axis=1)
    np.testing.assert_allclose(gap, 0.5 * x, atol=1e-4)
    # before touch the seam turns with the spin: 3,000 rpm are 314 rad/s
    before = np.flatnonzero(scene.time < 0.0)
    turned = (scene.ball.rotation * scene.ball_turn)[before]
    step = (turned[-1] * turned[0].inv()).magnitude()
    elapsed = scene.time[before[-1]] - scene.time[before[0]]
    assert step == pytest.approx(314.16 * elapsed, rel=1e-3)
    assert scene_of(simulate(Scenario(after=0.006), engine="compiled").history).ball_turn is None


def lowest_in_head(scene):
    """The lowest point of the drawn ball in the drawn head, (n, 3)."""
    half = scene.ball.rotation.apply([0.0, 0.0, 1.0]) * scene.ball_axes[:, 2:]
    return scene.head.rotation.inv().apply(scene.ball.place - half - scene.head.place)


@pytest.mark.parametrize("factors", [(1.0, 1.0), (8.0, 1.0), (5.0, 3.0), (0.5, 0.2)])
def test_ball_touches_the_drawn_strings_in_contact(history, factors):
    settings = AnimationSettings(magnify=factors[0], magnify_strings=factors[1])
    scene, true = scene_of(history, settings), scene_of(history)
    now = scene.in_contact
    assert now.sum() > 10
    drawn, model = lowest_in_head(scene)[now], lowest_in_head(true)[now]
    np.testing.assert_allclose(drawn[:, 2], scene.strings[now, 0], atol=1e-9)  # of point 1
    np.testing.assert_allclose(drawn[:, :2], model[:, :2], atol=1e-9)
    assert np.ptp(model[:, 1]) > 0.01  # it slides
    # no jump: at most as fast as the model's ball, and magnified with the strings
    steps, own = (np.linalg.norm(np.diff(x.ball.place, axis=0), axis=1) for x in (scene, true))
    assert steps.max() < 1.2 * max(1.0, factors[1]) * own.max()


def test_ball_touches_magnified_strings_that_let_go_of_it_above_their_plane():
    """The head clamped: the strings throw the ball from above the plane, with their speed."""
    run = simulate(Scenario(support="clamped_head", after=0.006, audit=False))
    scene = scene_of(run.history, AnimationSettings(magnify_strings=4.0), frames=300)
    now, lowest = scene.in_contact, lowest_in_head(scene)[:, 2]
    assert scene.strings[now, 4].max() > 1e-3
    np.testing.assert_allclose(lowest[now], scene.strings[now, 4], atol=1e-9)
    assert np.abs(np.diff(lowest)).max() < 4.0 * 1.1 * 25.0 * np.diff(scene.time).max()


def test_magnify_bends_the_head_about_the_handle_and_leaves_a_ball_that_is_away(history):
    true, drawn = scene_of(history), scene_of(history, AnimationSettings(magnify=7.0))
    np.testing.assert_array_equal(drawn.handle.place, true.handle.place)

    def angles(scene):
        return (scene.handle.rotation.inv() * scene.head.rotation).as_euler("ZYX")

    np.testing.assert_allclose(angles(drawn), 7.0 * angles(true), atol=1e-12)
    assert np.abs(angles(true)[:, 1]).max() > 0.01
    throat = [[true.geometry.handle_length, 0.0, 0.0]]
    np.testing.assert_allclose(drawn.handle.points(throat)[:, 0], drawn.head.place, atol=1e-12)
    normal = true.head.rotation.apply([0.0, 0.0, 1.0])
    height = np.sum((true.ball.place - true.head.place) * normal, axis=1)
    away = height > 0.1 + 1.2 * true.geometry.ball_radius  # of its centre
    assert away.sum() > 5
    # both are turned with the strings of the last contact, which are not the same
    gap = np.linalg.norm(drawn.ball.place - true.ball.place, axis=1)
    assert gap[away].max() < true.geometry.ball_radius * 2.0 * np.abs(7.0 * angles(true)).max()


def test_a_clamped_head_stays_and_the_handle_is_drawn_bent(history):
    scenario = json.loads(history.attrs["scenario"]) | {"support": "clamped_head"}
    clamped = history.assign_attrs(scenario=json.dumps(scenario))
    true, drawn = scene_of(clamped), scene_of(clamped, AnimationSettings(magnify=7.0))
    np.testing.assert_array_equal(drawn.head.place, true.head.place)
    throat = [[true.geometry.handle_length, 0.0, 0.0]]
    np.testing.assert_allclose(drawn.handle.points(throat)[:, 0], drawn.head.place, atol=1e-12)
    assert np.abs(drawn.handle.place - true.handle.place).max() > 0.005


def test_limb_is_segments_of_its_lengths_up_to_the_grip(limb_history):
    scene, limb = scene_of(limb_history), load_upper_limb()
    assert len(scene.landmarks) == 4
    lengths = [limb.upper_arm.length.value, limb.forearm.length.value]
    for (start, end), length in zip(scene.geometry.segments, lengths, strict=False):
        found = np.linalg.norm(scene.landmarks[end] - scene.landmarks[start], axis=1)
        np.testing.assert_allclose(found, length, atol=1e-6)
    shoulder = scene.landmarks[scene.geometry.segments[0][0]]
    np.testing.assert_allclose(shoulder, np.tile(Scenario().limb.place, (len(shoulder), 1)))
    assert scene.geometry.segments[-1][1] == "hand"
    grip = Scenario().load_racket().landmarks.grip.value
    held = scene.handle.points(np.array([[grip, 0.0, 0.0]]))[0, 0]
    np.testing.assert_allclose(scene.landmarks["hand"][0], held, atol=1e-9)


def test_outline_is_the_one_of_the_figures(history):
    racket = Scenario().load_racket()
    axes = new_figure(3.0, 3.0).subplots()
    draw_outline(axes, racket)
    rim, handle, *arms = (np.array(line.get_data()).T / 1e3 for line in axes.lines)
    g = read_geometry(history)
    outline = racket_outline(g)
    throat = np.array([g.handle_length, 0.0])
    centre = np.array([g.handle_length + g.gsc, 0.0])
    for line in (rim - centre, outline.rim[:, :2] + throat - centre):
        on_ellipse = (line / [g.rim_semi_axis_x, g.rim_semi_axis_y]) ** 2
        np.testing.assert_allclose(on_ellipse.sum(axis=1), 1.0, rtol=1e-9)
    assert {tuple(p) for p in handle.round(9)} == {tuple(p) for p in outline.grip[:, :2].round(9)}
    for arm, near, far in zip(arms, outline.handle_arms, outline.head_arms, strict=True):
        ends = np.array([near[0, :2], far[-1, :2] + throat])
        np.testing.assert_allclose(ends, arm, atol=1e-12)
        np.testing.assert_allclose(near[-1, :2], far[0, :2] + throat, atol=1e-12)
        assert near[-1, 0] == pytest.approx(g.handle_length)  # the joint cuts it


def test_rim_springs_end_on_the_rim_and_others_on_points(history):
    g = read_geometry(history)
    column = {i: (1 - (i - 1) % 3, 1 - (i - 1) // 3) for i in range(1, 10)}
    ends = spring_ends(g)
    assert len(ends) == 24
    for i, j, vector in ends:
        y, x = (g.spacing * n for n in column[i])
        end = np.array([x, y]) + vector[:2]
        if j:
            np.testing.assert_allclose(end, [g.spacing * n for n in column[j]][::-1], atol=1e-12)
        else:
            on_ellipse = (end / [g.rim_semi_axis_x, g.rim_semi_axis_y]) ** 2
            assert on_ellipse.sum() == pytest.approx(1.0)
            assert abs(end).sum() > abs(np.array([x, y])).sum()


@pytest.mark.parametrize("closed", [False, True])
def test_tubes_are_closed_surfaces_with_their_volume(closed):
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    line = np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    length = 2.0 * np.pi
    if not closed:
        line, length = np.array([[0.0, 0.0, 0.0], [0.3, 0.4, 0.0], [0.6, 0.8, 0.0]]), 1.0
    vertices, triangles = tube(line, 0.1, 0.05)
    a, b, c = (vertices[:, row] for row in triangles)
    volume = np.sum(np.cross(a, b, axis=0) * c) / 6.0
    polygon = 6.0 * np.sin(np.pi / 6.0)  # of twelve sides around a unit circle
    assert volume == pytest.approx(polygon * 0.1 * 0.05 * length, rel=2e-3)
    edges = np.concatenate([triangles[[0, 1]], triangles[[1, 2]], triangles[[2, 0]]], axis=1).T
    assert {(p, q) for p, q in edges} == {(q, p) for p, q in edges}


def sockets():
    names = []
    for name in os.listdir("/proc/self/fd"):
        try:
            names.append(os.readlink(f"/proc/self/fd/{name}"))
        except OSError:
            continue
    return sum(name.startswith("socket:") for name in names)


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="needs /proc")
def test_page_is_whole_and_leaves_no_server(limb_history, tmp_path):
    titled = limb_history.assign_attrs(title="<b>Racket & co</b>")
    before = sockets()
    scene = animate(titled, tmp_path / "page.html", AnimationSettings(slowdown=200.0))
    assert sockets() == before
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<title>&lt;b&gt;Racket &amp; co&lt;/b&gt;</title>" in text
    assert "<b>Racket" not in text
    assert "Content-Security-Policy" in text
    assert not re.search(r"<(?:script|link|img|iframe)[^>]*(?:src|href)=[\"']?(?:https?:)?//", text)
    assert "cdn.jsdelivr" not in text
    assert "1/200 of real speed; bending of the frame magnified 5 times" in text
    data = json.loads(re.search(r"const data = (\{.*?\});", text)[1])
    assert len(data["time"]) == len(scene.time) == round(0.002 * 200 * 30) + 1
    assert data["time"][-1] == pytest.approx(2.0, abs=0.01)
    assert [p.name for p in tmp_path.iterdir()] == ["page.html"]


def test_gif_is_a_film_of_all_frames(log, tmp_path):
    from PIL import Image, ImageChops

    app = typer.Typer()
    app.command()(command.animate)
    out = tmp_path / "new" / "film.GIF"
    options = ["--out", str(out), "--slowdown", "50", "--magnify", "3"]
    result = CliRunner().invoke(app, [str(log.parent), *options])
    assert result.exit_code == 0, result.output
    assert "magnified 3 times" in result.output
    with Image.open(out) as film_file:
        assert film_file.size == (960, 600)
        assert film_file.n_frames == int(0.020 * 50 * 12.5) + 1
        assert film_file.info["duration"] == 80
        first = film_file.convert("RGB")
        film_file.seek(film_file.n_frames - 1)
        assert ImageChops.difference(first, film_file.convert("RGB")).getbbox() is not None
        colours = {colour for _, colour in first.getcolors(100_000)}
    assert any(abs(r - 230) + abs(g - 159) + abs(b) < 40 for r, g, b in colours)  # the ball


@pytest.mark.skipif(film._ffmpeg() is None, reason="no ffmpeg")
def test_mp4_is_h264(history, tmp_path):
    out = tmp_path / "film.mp4"
    animate(history, out, AnimationSettings(slowdown=20.0))
    head = out.read_bytes()
    assert head[4:8] == b"ftyp"
    assert b"avc1" in head


def test_an_ffmpeg_without_h264_is_said_and_leaves_nothing(history, tmp_path, monkeypatch):
    monkeypatch.setattr(film, "_ffmpeg", lambda: shutil.which("false"))
    with pytest.raises(InputError, match=r"H\.264"):
        animate(history, tmp_path / "film.mp4", AnimationSettings(slowdown=20.0))
    assert list(tmp_path.iterdir()) == []


BAD = {
    "suffix": ("film.avi", {}, r"--out: .*\.html, \.gif, \.mp4"),
    "magnify": ("film.html", {"magnify": 0.0}, "--magnify: got 0.0"),
    "strings": ("film.html", {"magnify_strings": -1.0}, "--magnify-strings: got -1.0"),
    "slowdown": ("film.gif", {"slowdown": float("nan")}, "--slowdown: got nan"),
    "too slow": ("film.html", {"slowdown": 1e7}, "--slowdown: .* for 20 ms"),
    "too fast": ("film.html", {"slowdown": 0.1}, "--slowdown: .* for 20 ms"),
    "fps": ("film.gif", {"fps": 60.0}, "--fps: .* 1 to 50"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_settings_are_one_line_and_write_nothing(history, tmp_path, name):
    file, changes, message = BAD[name]
    with pytest.raises(InputError, match=message) as error:
        animate(history, tmp_path / "new" / file, AnimationSettings(**changes))
    assert "\n" not in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_mp4_without_ffmpeg_names_the_extra(history, tmp_path, monkeypatch):
    monkeypatch.setattr(film, "_ffmpeg", lambda: None)
    with pytest.raises(InputError, match=r"drake-racket\[video\]"):
        animate(history, tmp_path / "film.mp4")


@pytest.mark.parametrize("broken", ["variable", "attribute", "geometry", "nan"])
def test_a_log_that_is_no_history_is_one_line(history, tmp_path, broken):
    changed = {
        "variable": lambda: history.drop_vars("handle_quaternion"),
        "attribute": lambda: history.drop_attrs(deep=False),
        "geometry": lambda: history.assign_attrs(geometry='{"gsc": 1}'),
        "nan": lambda: history.assign(butt_position=history["butt_position"] * np.nan),
    }[broken]()
    with pytest.raises(InputError, match="LOG") as error:
        animate(changed, tmp_path / "page.html")
    assert "\n" not in str(error.value)
    assert list(tmp_path.iterdir()) == []


@hypothesis_settings(max_examples=100, deadline=None)
@given(
    duration=st.floats(1e-9, 10.0),
    slowdown=st.floats(),
    fps=st.none() | st.floats(),
    name=st.sampled_from(["a.html", "a.gif", "a.MP4"]),
)
def test_any_settings_give_frames_that_cover_the_log_or_one_line(duration, slowdown, fps, name):
    settings, path = AnimationSettings(slowdown=slowdown, fps=fps), Path(name)
    try:
        check_settings(settings, path)
        frames = frame_count(duration, settings, path)
    except InputError as error:
        message = str(error)
    else:
        message = ""
    assert "\n" not in message
    if message:
        return
    covered = (frames - 1) / (settings.frame_rate(path) * slowdown)
    step = 1.0 / (settings.frame_rate(path) * slowdown)
    assert 2 <= frames <= 10_000
    assert duration - step < covered * (1.0 + 1e-9)
    assert covered < duration * (1.0 + 1e-9)


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium")
def test_page_moves_in_a_browser_and_asks_for_nothing(limb_history, tmp_path):
    playwright = pytest.importorskip("playwright.sync_api")
    flags = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"]
    flags += ["--enable-unsafe-swiftshader", "--disable-background-networking"]
    with playwright.sync_playwright() as tools:
        browser = tools.chromium.launch(executable_path=CHROMIUM, args=flags)
        path = tmp_path / "page.html"
        scene = animate(limb_history, path)
        _check_page(browser.new_page(viewport={"width": 480, "height": 300}), path, scene)
        browser.close()


def _check_page(page, path, scene):
    asked, said = [], []
    page.context.set_offline(True)
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto(path.as_uri())
    page.wait_for_function(
        "window.racketAnimation && viewer.animator.actions.length", timeout=60000
    )
    # it plays by itself
    first = page.evaluate("viewer.animator.time")
    page.wait_for_function(f"viewer.animator.time != {first}", timeout=30000)
    shots = [_shot(page, k) for k in (0, len(scene.time) // 2)]
    assert shots[0] != shots[1]
    assert _shot(page, 0) == shots[0]
    assert page.title() == scene.title
    assert page.inner_text("#racket-time").startswith(f"{1e3 * scene.time[0]:.2f} ms")
    # nine masses and 24 springs are in the scene, where the scene has them
    last = len(scene.time) - 1
    page.evaluate(f"racketAnimation.seek({last})")
    for i in range(9):
        path_js = f'["racket", "head", "point_{i + 1}"]'
        place = page.evaluate(f"viewer.scene_tree.find({path_js}).object.position.toArray()")
        assert place[2] == pytest.approx(scene.strings[last, i], abs=1e-5)
    springs = page.evaluate(
        "Object.values(viewer.scene_tree.find(['racket', 'head']).children)"
        ".flatMap(n => Object.keys(n.children)).filter(n => n.startsWith('spring_')).length"
    )
    assert springs == 24
    assert said == []
    assert [url for url in asked if not url.startswith(("file:", "data:", "blob:"))] == []


def _shot(page, frame):
    """The canvas alone: the words around it would differ in any case."""
    from PIL import Image

    page.evaluate(f"racketAnimation.seek({frame})")
    data = page.evaluate("viewer.capture_image(240, 150)")
    picture = Image.open(io.BytesIO(base64.b64decode(data.partition(",")[2]))).convert("RGB")
    colours = np.array(picture).reshape(-1, 3).astype(int)
    red, blue = colours[:, 0], colours[:, 2]
    assert np.sum((red > 120) & (blue < 80)) > 5  # ball
    assert np.sum((blue > 120) & (red < 60)) > 20  # frame
    assert np.sum(colours.min(axis=1) > 250) > 10_000  # background
    return picture


def test_pages_can_be_made_at_the_same_time(limb_history):
    from concurrent.futures import ThreadPoolExecutor

    scene = scene_of(limb_history, AnimationSettings(slowdown=10.0), frames=5)
    with ThreadPoolExecutor(4) as pool:
        pages = list(pool.map(lambda _: meshcat_page(scene), range(4)))
    assert all(len(text) > 2_000_000 for text in pages)
