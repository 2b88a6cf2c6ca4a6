"""What animations show of a log that is made of formulas, frame by frame and number by number."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray

import drake_racket as dr
from drake_racket.animation import AnimationSettings, film, meshcat_page, page, write
from drake_racket.animation.camera import Camera, place_camera
from drake_racket.animation.limb_shape import limb_parts
from drake_racket.animation.outline import racket_outline, spring_ends, string_points, tube
from drake_racket.animation.scene import Scene, make_scene, read_geometry
from drake_racket.animation.settings import check_settings, frame_count
from tests.plots.made_log import made_log
from tests.recorded import check_record

RECORDS = Path(__file__).parent / "records"
CLAMPED = {"support": "clamped_head", "speed": 31.5, "incidence_deg": 0.0, "point": "auto"}
MAGNIFIED = AnimationSettings(slowdown=300.0, magnify=4.0, magnify_strings=3.0)


def scene_of(log: Any, settings: AnimationSettings = MAGNIFIED, fps: float = 10.0) -> Scene:
    return make_scene(log, read_geometry(log), settings, fps, 37)


@pytest.fixture(autouse=True)
def units():
    """Logs that are changed keep their units."""
    with xarray.set_options(keep_attrs=True):
        yield


def with_geometry(log: Any, **changes: Any) -> Any:
    return log.assign_attrs(geometry=json.dumps(json.loads(log.attrs["geometry"]) | changes))


@pytest.fixture(scope="module")
def log():
    return made_log(end=0.012)


@pytest.fixture(scope="module")
def scene(log):
    return scene_of(log)


def pose(one: Any) -> list[Any]:
    """Columns of places and of rotations' matrices."""
    turned = one.rotation.as_matrix().reshape(len(one.place), 9)
    return [*one.place.T, *turned.T]


def told(scene: Scene) -> dict[str, Any]:
    """All that a scene has, in numbers."""
    return {
        "fps": scene.fps,
        "time": scene.time,
        "handle": pose(scene.handle),
        "head": pose(scene.head),
        "strings": list(scene.strings.T),
        "ball": pose(scene.ball),
        "axes": list(scene.ball_axes.T),
        "turn": scene.ball_turn and list(scene.ball_turn.as_matrix().reshape(-1, 9).T),
        "landmarks": {name: list(places.T) for name, places in scene.landmarks.items()},
        "force": scene.force,
        "bending": scene.bending,
        "inside": [int(one) for one in scene.in_contact],
        "title": scene.title,
    }


SCENES = {
    "held": lambda log: log,
    "point": lambda log: log.drop_vars("ball_quaternion"),
    "clamped": lambda log: log.assign_attrs(scenario=json.dumps(CLAMPED)),
    "without_limb": lambda log: log.drop_vars(["landmark_x", "landmark_y", "landmark_z"]),
    "missed": lambda log: log.assign(in_contact=0.0 * log["in_contact"]),
    "flat": lambda log: log.assign(compression=log["compression"] * 8.0),
}


@pytest.mark.parametrize("name", SCENES)
def test_scenes(log, name):
    check_record(told(scene_of(SCENES[name](log))), RECORDS / f"scene_{name}.json")


def test_where_it_is_seen_from(log, scene):
    found = {}
    alone = log.drop_vars([f"landmark_{a}" for a in "xyz"])
    alone = alone.assign_attrs(
        geometry=json.dumps(json.loads(log.attrs["geometry"]) | {"segments": []})
    )
    low = alone.assign(
        handle_quaternion=log["handle_quaternion"] * 0.0
        + np.array([np.cos(1.2), np.sin(1.2), 0.0, 0.0])
    )
    under = low.assign(**{f"landmark_{a}": log[f"landmark_{a}"] for a in "xyz"})
    under = under.assign_attrs(geometry=log.attrs["geometry"])
    for name, one in (("limb", log), ("alone", alone), ("low", low), ("under", under)):
        seen = scene_of(one)
        camera = place_camera(seen)
        found[name] = [
            *map(list, (camera.place, camera.target)),
            *map(list, camera.bar),
            *map(list, camera.axes()),
            list(camera.project(seen.ball.place).T),
        ]
    check_record(found, RECORDS / "cameras.json")


def test_a_camera_shows_what_it_looks_at_in_the_middle():
    camera = Camera(np.array([0.0, -2.0, 1.0]), np.array([0.0, 0.0, 1.0]), np.zeros((2, 3)))
    half = 2.0 * np.tan(np.radians(17.5))  # of the picture's height, at 2 m
    assert camera.project(np.array([0.0, 0.0, 1.0])) == pytest.approx([0.0, 0.0])
    assert camera.project(np.array([half, 0.0, 1.0])) == pytest.approx([1.0, 0.0])
    assert camera.project(np.array([0.0, 0.0, 1.0 + half])) == pytest.approx([0.0, 1.0])
    behind = camera.project(np.array([0.001, -3.0, 1.0]))
    assert behind == pytest.approx([1.0 / np.tan(np.radians(17.5)), 0.0])  # not nearer than 1 mm


def test_shapes(scene):
    outline = racket_outline(scene.geometry)
    spheres, segments = limb_parts(scene)
    bent = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.1, 0.0], [0.2, 0.3, 0.0]])
    around = [tube(outline.rim[::12], 0.01, 0.02), tube(bent, 0.02, 0.01)]
    ends = spring_ends(scene.geometry)
    check_record(
        {
            "points": list(string_points(scene.geometry).T),
            "springs": [[i, j, *vector] for i, j, vector in ends],
            "tubes": [[*vertices, *triangles] for vertices, triangles in around],
            "triangles": around[1][1].T[:8].tolist() + around[1][1].T[-5:].tolist(),
            "spheres": [[name, list(places.T), radius] for name, places, radius in spheres],
            "segments": [[pose(one), length, radius] for one, length, radius in segments],
            "film": [list(film._sphere().T), list(film._cylinder(0.1, 0.4).T)],
        },
        RECORDS / "shapes.json",
    )


def test_limbs_of_any_size(log):
    """Radii are a share of the length, between those of a finger and of a thigh."""
    for factor, radius in ((0.1, 0.018), (1.0, 0.045), (10.0, 0.045)):
        other = log.assign(**{f"landmark_{a}": factor * log[f"landmark_{a}"] for a in "xyz"})
        scene = scene_of(other)
        spheres, segments = limb_parts(scene)
        assert segments[0][2] == pytest.approx(radius, rel=0.3)
        assert all(0.018 <= one <= 0.045 for _, _, one in spheres)


def hull(patch: Any) -> list[float]:
    """Least and largest of both coordinates: which corners a round hull has hangs on round-off."""
    corners = patch.get_xy()
    return [*corners.min(axis=0), *corners.max(axis=0)]


def artists(picture: film._Picture) -> dict[str, Any]:
    """What a frame's artists have."""
    text = picture._now
    return {
        "frame": [list(np.array(line.get_data())) for line in picture._frame],
        "grip": list(picture._handle.get_xy().T),
        "springs": list(np.array(picture._strings.get_segments()).reshape(-1, 4).T),
        "points": list(np.array(picture._points.get_data())),
        "ball": [*hull(picture._ball), picture._ball.get_zorder()],
        "seam": [*np.array(picture._seam.get_data()), picture._seam.get_zorder()],
        "joints": [hull(one) for one in picture._joints],
        "parts": [hull(one) for one in picture._parts],
        "orders": [one.get_zorder() for one in picture._moving],
        "widths": [
            *sorted({line.get_linewidth() for line in (*picture._frame, picture._seam)}),
            *picture._strings.get_linewidths(),
            picture._points.get_markersize(),
            picture._ball.get_linewidth(),
        ],
        "now": [text.get_text(), *text.get_position()],
    }


def test_pictures_of_a_film(scene, log):
    picture = film._Picture(scene)
    found: dict[str, Any] = {}
    for k in (0, 13, 30):
        pixels = picture.pixels(k)
        found[f"frame {k}"] = artists(picture)
    assert pixels.shape == (600, 960, 3)
    axes = picture._axes
    found["words"] = [[t.get_text(), *t.get_position()] for t in axes.texts]
    found["legend"] = [t.get_text() for t in axes.get_legend().get_texts()]
    found["bar"] = list(np.array(axes.lines[-1].get_data()))
    found["limits"] = [*axes.get_xlim(), *axes.get_ylim()]
    assert np.ptp(pixels.astype(float)) > 200.0
    point = film._Picture(scene_of(SCENES["point"](log)))
    point._place(13)
    found["without spin"] = artists(point)["seam"]
    check_record(found, RECORDS / "film.json")


def test_a_ball_on_the_other_side_is_behind_the_strings(log):
    turned = log.assign(handle_quaternion=log["handle_quaternion"] * 0.0 + [0.0, 1.0, 0.0, 0.0])
    picture = film._Picture(scene_of(log))
    picture.camera = place_camera(scene_of(turned))
    picture._place(13)
    assert (picture._ball.get_zorder(), picture._seam.get_zorder()) in ((3, 3.5), (6, 6.5))
    head = picture.scene.head
    normal = head.rotation[13].as_matrix()[:, 2]
    before = normal @ (picture.camera.place - head.place[13]) > 0.0
    assert (picture._ball.get_zorder() == 6) == before


class Mesh:
    """Stands for Meshcat and its animation: writes down what it is told."""

    LoopMode = SimpleNamespace(kLoopRepeat="repeat")

    def __init__(self, *arguments: Any, **options: Any) -> None:
        self.said: list[Any] = []

    def __getattr__(self, name: str) -> Any:
        def say(*arguments: Any, **options: Any) -> None:
            self.said.append([name, *map(plain, arguments)])

        return say

    def StaticHtml(self) -> str:
        """A page."""
        return "<title>Drake MeshCat</title><body></body>"


def plain(one: Any) -> Any:
    """Drake's objects in numbers."""
    if isinstance(one, (str, bool, int, float)):
        return one
    if isinstance(one, Mesh):
        return "animation"
    if hasattr(one, "rgba"):
        return list(one.rgba)
    if hasattr(one, "GetAsMatrix34"):
        return np.asarray(one.GetAsMatrix34()).round(9).reshape(-1).tolist()
    if hasattr(one, "radius"):
        return [
            type(one).__name__,
            one.radius(),
            *([one.length()] if hasattr(one, "length") else []),
        ]
    if isinstance(one, (list, np.ndarray)):
        return [np.asarray(row) for row in np.atleast_2d(np.asarray(one, dtype=float))]
    return type(one).__name__


def _numbers(one: Any) -> Any:
    """One argument's numbers in a row; of a shape, its lengths."""
    if isinstance(one, list):
        rows = one[1:] if isinstance(one[0], str) else one
        return np.concatenate([np.ravel(row) for row in rows])
    return np.ravel(one)


def short(said: list[Any]) -> dict[str, Any]:
    """By what was said of what: how often, first and last; and the sum of all numbers."""
    found: dict[str, Any] = {}
    for name, *rest in said:
        path = next((one for one in rest if isinstance(one, str) and one.startswith("/")), "")
        property_ = rest[2] if name == "SetProperty" and isinstance(rest[0], int) else ""
        arrays = [_numbers(one) for one in rest if not isinstance(one, str)]
        at = found.setdefault(" ".join(filter(None, (name, path, property_))), [0, [], []])
        weighed = [one * (1.0 + np.arange(len(one))) for one in map(np.asarray, arrays)]
        at[0] += 1
        at[1] = [value for one in arrays for value in one[:8]]
        before = at[2] or [[0.0, 0.0] for _ in weighed]
        at[2] = [
            [total + float(one.sum()), size + float(np.abs(one).sum())]
            for (total, size), one in zip(before, weighed, strict=True)
        ]
    return found


def test_what_a_page_is_told(scene, monkeypatch):
    meshes = []

    def made(*arguments: Any, **options: Any) -> Mesh:
        meshes.append(Mesh())
        return meshes[-1]

    made.PerspectiveCamera = lambda fov: SimpleNamespace(rgba=[fov])
    made.LoopMode = Mesh.LoopMode
    asked = []
    monkeypatch.setattr(meshcat_page, "Meshcat", made)
    monkeypatch.setattr(meshcat_page, "MeshcatParams", lambda **how: asked.append(how))
    monkeypatch.setattr(meshcat_page, "MeshcatAnimation", lambda fps: asked.append(fps) or made())
    meshcat_page.MeshcatAnimation.LoopMode = Mesh.LoopMode
    text = meshcat_page.meshcat_page(scene)
    assert asked == [{"host": "localhost", "port": 0, "show_stats_plot": False}, 10.0]
    check_record(
        {"scene": short(meshes[0].said), "animation": short(meshes[1].said)},
        RECORDS / "page.json",
    )
    data = json.loads(text.split("const data = ")[1].split(";\n")[0])
    assert data == {
        "time": np.round(1e3 * scene.time, 4).tolist(),
        "force": np.round(scene.force, 1).tolist(),
        "bending": np.round(np.degrees(scene.bending), 3).tolist(),
        "contact": [int(one) for one in scene.in_contact],
        "fps": 10.0,
    }


def test_a_run_of_equal_values_keeps_its_ends():
    for values, kept in (
        ([1, 1, 1, 1], [0, 3]),
        ([1, 2, 2, 2, 3], [0, 1, 3, 4]),
        ([1, 1], [0, 1]),
        ([1, 2, 3], [0, 1, 2]),
    ):
        mesh = Mesh()
        meshcat_page._set(mesh, "/a", "scale", np.array(values, dtype=float)[:, None])
        assert [one[1] for one in mesh.said] == kept


def test_words_of_a_scene(log, scene):
    assert page.case_text(scene) == "support: grip; ball 20 m/s, 15° from the normal, point 6"
    aimed = scene_of(log.assign_attrs(scenario=json.dumps(CLAMPED)), AnimationSettings(magnify=1.0))
    assert page.case_text(aimed).endswith("31.5 m/s, 0° from the normal, aimed at the centre")
    assert page.exaggeration_text(aimed) == (
        "1/500 of real speed; bending of the frame true to scale;"
        " deflection of the strings true to scale"
    )
    assert page.exaggeration_text(scene).endswith("strings magnified 3 times")
    assert page.exaggeration_text(scene).startswith("1/300 of real speed; bending of the frame m")
    limb = [text for _, text in page.legend(scene)]
    assert limb[4:] == ["limb", "bar: 100 mm"]
    alone = scene_of(log.drop_vars([f"landmark_{a}" for a in "xyz"]))
    assert len(page.legend(alone)) == 5
    held = log.assign_attrs(
        geometry=json.dumps(json.loads(log.attrs["geometry"]) | {"segments": []})
    )
    assert page.legend(scene_of(held))[4][1] == "hand"


@pytest.mark.parametrize(
    ("name", "fps", "rate"),
    [
        ("a.html", None, 30.0),
        ("a.mp4", None, 30.0),
        ("a.GIF", None, 12.5),
        ("a.gif", 30.0, 100 / 3),
        ("a.mp4", 24.0, 24.0),
        ("a.gif", 18.0, 100 / 6),
        ("a.gif", 22.3, 25.0),
    ],
)
def test_frame_rates(name, fps, rate):
    assert AnimationSettings(fps=fps).frame_rate(Path(name)) == pytest.approx(rate)


@pytest.mark.parametrize(("suffix", "most"), [("html", 120.0), ("gif", 50.0), ("mp4", 120.0)])
def test_rates_that_are_allowed(suffix, most):
    path = Path(f"a.{suffix}")
    for fps in (1.0, most):
        check_settings(AnimationSettings(fps=fps), path)
    for fps in (0.99, most + 0.1):
        with pytest.raises(dr.InputError, match=f"1 to {most:g} per second"):
            check_settings(AnimationSettings(fps=fps), path)


def test_how_many_frames():
    path = Path("a.html")
    assert frame_count(0.01, AnimationSettings(slowdown=500.0), path) == 151
    assert frame_count(1.0, AnimationSettings(slowdown=1.0 / 30.0), path) == 2
    with pytest.raises(dr.InputError, match=r"3\.33 to 3\.33e\+04 for 10 ms"):
        frame_count(0.01, AnimationSettings(slowdown=33_334.0), path)
    assert frame_count(0.01, AnimationSettings(slowdown=33_333.0), path) == 10_000


@pytest.mark.parametrize(
    ("length", "good"), [(1e-6, True), (0.0, False), (10.0, True), (10.1, False), (-1.0, False)]
)
def test_lengths_of_a_log(log, length, good):
    changed = with_geometry(log, gsc=length)
    if good:
        assert read_geometry(changed).gsc == length
        return
    with pytest.raises(dr.InputError, match="above 0, up to 10 m"):
        read_geometry(changed)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda log: log.drop_vars("handle_quaternion"), "this lacks handle_quaternion"),
        (lambda log: log.isel(spring=slice(None, 9)), "springs of a bed"),
        (lambda log: log.isel(point=slice(None, 8)), "springs of a bed"),
        (lambda log: log.assign_attrs(geometry="[]"), "lengths that drake-racket impact writes"),
        (lambda log: log.drop_vars("landmark"), "no segments"),
    ],
)
def test_logs_that_cannot_be_shown(log, change, said):
    with pytest.raises(dr.InputError, match=said):
        read_geometry(change(log))


class Encoder:
    """Stands for ffmpeg: keeps what it is given."""

    def __init__(self, command: list[str], **how: Any) -> None:
        self.command, self.how, self.bytes, self.returncode = command, how, 0, 0
        self.stdin = SimpleNamespace(write=self.write, close=lambda: None)
        Encoder.last = self

    def write(self, data: bytes) -> None:
        """Counts."""
        self.bytes += len(data)

    def __enter__(self) -> Encoder:
        """Runs."""
        return self

    def __exit__(self, *_: Any) -> None:
        """Ends."""


def test_what_an_encoder_is_given(monkeypatch, tmp_path):
    monkeypatch.setattr(subprocess, "Popen", Encoder)
    monkeypatch.setattr(film, "_ffmpeg", lambda: None)
    frames = iter([np.zeros((600, 960, 3), np.uint8)] * 3)
    film._write_mp4(frames, 12.5, tmp_path / "a.mp4")
    done = Encoder.last
    assert done.bytes == 3 * 600 * 960 * 3
    assert done.command[0] == "ffmpeg"
    at = done.command.index
    assert done.command[at("-s") + 1] == "960x600"
    assert done.command[at("-r") + 1] == "12.5"


def test_which_encoder(monkeypatch):
    monkeypatch.setattr(film.shutil, "which", lambda name: f"/bin/{name}")
    assert film._ffmpeg() == "/bin/ffmpeg"
    film.check_film(Path("a.mp4"))
    monkeypatch.setattr(film.shutil, "which", lambda name: None)
    monkeypatch.setattr(
        film.importlib, "import_module", lambda name: SimpleNamespace(get_ffmpeg_exe=lambda: "own")
    )
    assert film._ffmpeg() == "own"

    def missing(name: str) -> Any:
        raise ImportError(name)

    monkeypatch.setattr(film.importlib, "import_module", missing)
    assert film._ffmpeg() is None
    film.check_film(Path("a.gif"))
    with pytest.raises(dr.InputError, match="install ffmpeg"):
        film.check_film(Path("a.MP4"))


def test_frames_of_a_gif(tmp_path):
    from PIL import Image

    frames = [np.roll(np.arange(144, dtype=np.uint8).reshape(6, 8, 3), k, 0) for k in range(3)]
    film._write_gif(iter(frames), 12.5, tmp_path / "a.gif")
    with Image.open(tmp_path / "a.gif") as found:
        assert (found.n_frames, found.info["duration"], found.info["loop"]) == (3, 80, 0)


def test_frames_are_counted_for_whoever_waits(monkeypatch, scene, tmp_path):
    monkeypatch.setattr(film, "_Picture", lambda scene: SimpleNamespace(pixels=lambda k: k))
    seen = []
    assert list(film._frames(scene, seen.append)) == list(range(37))
    assert [(now.task, now.done, now.total) for now in seen] == [
        ("frames", k, 37) for k in range(1, 38)
    ]
    assert list(film._frames(scene, None)) == list(range(37))


def test_what_is_asked_for_a_file(log, monkeypatch, tmp_path):
    asked = []
    monkeypatch.setattr(write, "_write", lambda scene, path, progress: asked.append(path.name))
    scene = write.animate(log, tmp_path / "new" / "a.html", AnimationSettings(slowdown=100.0))
    assert len(scene.time) == int(0.016 * 100 * 30 + 1e-9) + 1
    assert scene.time[0] == -0.004
    assert np.diff(scene.time) == pytest.approx(1.0 / 3000.0)
    assert write.animate(log, tmp_path / "b.html").settings == AnimationSettings()
    assert asked == ["a.html", "b.html"]
