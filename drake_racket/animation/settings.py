"""The settings say how an animation is played and what it exaggerates."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from drake_racket.io.errors import InputError

FORMATS = (".html", ".gif", ".mp4")
_DEFAULT_FPS = {".html": 30.0, ".gif": 12.5, ".mp4": 30.0}
_MOST_FPS = {".html": 120.0, ".gif": 50.0, ".mp4": 120.0}
_MOST_FRAMES = 10_000


@dataclass(frozen=True)
class AnimationSettings:
    """The settings say how an animation is played and what it exaggerates.

    Attributes:
        slowdown: seconds of animation per second of the impact.
        fps: frames per second of the animation; None for the format's own (30, a GIF 12.5).
        magnify: factor on the two angles of the throat joint.
        magnify_strings: factor on the deflections of the string masses.

    """

    slowdown: float = 500.0
    fps: float | None = None
    magnify: float = 5.0
    magnify_strings: float = 1.0

    def frame_rate(self, path: Path) -> float:
        """Frames per second in the format of `path`: a GIF's delays are hundredths of a second."""
        suffix = path.suffix.lower()
        rate = self.fps or _DEFAULT_FPS[suffix]
        return 100.0 / round(100.0 / rate) if suffix == ".gif" else rate


def check_settings(settings: AnimationSettings, path: Path) -> None:
    """Checks the settings and the suffix of the file to be written.

    Raises:
        InputError: naming the option, its value and what is allowed.

    """
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise InputError("--out", path, "a name that ends in " + ", ".join(FORMATS))
    if path.is_dir():
        raise InputError("--out", path, "the name of a file")
    for key in ("slowdown", "magnify", "magnify_strings"):
        value = getattr(settings, key)
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"--{key.replace('_', '-')}", value, "a number above 0")
    most = _MOST_FPS[suffix]
    if settings.fps is not None and not 1.0 <= settings.fps <= most:
        raise InputError("--fps", settings.fps, f"1 to {most:g} per second for {suffix}")


def frame_count(duration: float, settings: AnimationSettings, path: Path) -> int:
    """Gives the number of frames for `duration` seconds of an impact.

    Raises:
        InputError: there would be none, or too many.

    """
    count = duration * settings.slowdown * settings.frame_rate(path)
    if not 1.0 <= count < _MOST_FRAMES:
        least, most = (n / (duration * settings.frame_rate(path)) for n in (1, _MOST_FRAMES))
        allowed = f"{least:.3g} to {most:.3g} for {1e3 * duration:.3g} ms"
        raise InputError("--slowdown", settings.slowdown, allowed)
    return int(count) + 1
