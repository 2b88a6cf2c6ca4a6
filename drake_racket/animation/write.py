"""Writes the animation of a history: the format follows the file's suffix."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from drake_racket.animation.settings import AnimationSettings, check_settings, frame_count
from drake_racket.io.files import check_directory, directory_error, replace_file, write_text
from drake_racket.io.progress import Report

if TYPE_CHECKING:
    import xarray

    from drake_racket.animation.scene import Scene


def animate(
    history: xarray.Dataset,
    path: str | Path,
    settings: AnimationSettings | None = None,
    *,
    progress: Report | None = None,
) -> Scene:
    """Writes an animation of `history` to `path`: .html, .gif or .mp4.

    Args:
        history: of `simulate` or `read_history`; nothing else is looked at.
        progress: called as frames of a film are drawn.

    Returns:
        What was drawn.

    Raises:
        InputError: the settings, the suffix or the history do not fit, a program that the format
            needs is missing, or the file cannot be written. Nothing is written then.

    """
    path = Path(path)
    settings = settings or AnimationSettings()
    check_settings(settings, path)
    check_directory(path.parent, "--out")
    if path.suffix.lower() != ".html":
        from drake_racket.animation.film import check_film

        check_film(path)
    from drake_racket.animation.scene import make_scene, read_geometry

    geometry = read_geometry(history)
    time = history["time"].to_numpy()
    frames = frame_count(float(time[-1] - time[0]), settings, path)
    scene = make_scene(history, geometry, settings, settings.frame_rate(path), frames)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _write(scene, path, progress)
    except OSError as error:
        raise directory_error(path.parent, error, "--out") from None
    return scene


def _write(scene: Scene, path: Path, progress: Report | None) -> None:
    if path.suffix.lower() == ".html":
        from drake_racket.animation.meshcat_page import meshcat_page

        write_text(meshcat_page(scene), path)
        return
    from drake_racket.animation.film import write_film

    replace_file(path, lambda temporary: write_film(scene, temporary, progress))
