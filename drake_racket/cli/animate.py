"""`drake-racket animate` makes a page or a film of one impact, from its log."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from drake_racket.cli.console import ending_on_signals, new_console, showing
from drake_racket.io.progress import Progress


def animate(
    log: Annotated[
        Path,
        typer.Argument(help="A history that `drake-racket impact --out` has written (impact.nc)."),
    ],
    out: Annotated[
        Path, typer.Option(help="File to write: .html (a page), .gif or .mp4 (needs ffmpeg).")
    ],
    magnify: Annotated[float, typer.Option(help="Factor on the bending of the frame.")] = 5.0,
    magnify_strings: Annotated[
        float, typer.Option(help="Factor on the deflection of the strings.")
    ] = 1.0,
    slowdown: Annotated[
        float, typer.Option(help="Seconds of animation per second of the impact.")
    ] = 500.0,
    fps: Annotated[
        float | None, typer.Option(help="Frames per second; 30 if not given, for a GIF 12.5.")
    ] = None,
) -> None:
    """Writes a slow motion of ball, strings, frame and limb; a page needs no server or network."""
    from drake_racket.animation import AnimationSettings
    from drake_racket.animation import animate as write_animation
    from drake_racket.results.formats import read_history

    history = read_history(log / "impact.nc" if log.is_dir() else log)
    settings = AnimationSettings(slowdown, fps, magnify, magnify_strings)
    with ending_on_signals("no file is written"), showing(_text) as report:
        scene = write_animation(history, out, settings, progress=report)
    console = new_console()
    console.print(
        f"{1e3 * (scene.time[-1] - scene.time[0]):.1f} ms in {len(scene.time)} frames,"
        f" {len(scene.time) / scene.fps:.1f} s at {scene.fps:g} per second;"
        f" bending magnified {magnify:g} times, strings {magnify_strings:g} times"
    )
    console.print(f"wrote {escape(str(out))}")


def _text(progress: Progress) -> str:
    return f"{progress.done:g} of {progress.total:g}"
