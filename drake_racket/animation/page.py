"""Writes the words around an animation, and the page: title, time, legend, controls, no network."""

from __future__ import annotations

import html
import json
import re
from importlib.resources import files

import numpy as np

from drake_racket.animation.camera import SCALE_BAR
from drake_racket.animation.scene import Scene
from drake_racket.plots.style import BLUE, ORANGE, SKY, VERMILION

FRAME, STRINGS, POINTS, BALL, LIMB = BLUE, "#333333", VERMILION, ORANGE, SKY
"""Colours of the racket's frame, the strings, their masses, the ball, and hand or limb."""

# Meshcat's page asks the network for nothing but models of hand controllers in virtual reality
_CONTROLLERS = "https://cdn.jsdelivr.net/npm/@webxr-input-profiles/assets@1.0/dist/profiles"
_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline';"
    " img-src data: blob:; font-src data:; connect-src data: blob:"
)


def legend(scene: Scene) -> list[tuple[str, str]]:
    """Gives the colour and text of everything that is drawn."""
    held = [] if not scene.landmarks else [(LIMB, "limb" if scene.geometry.segments else "hand")]
    return [
        (BALL, "ball, flattened by its compression"),
        (STRINGS, "strings"),
        (POINTS, "string masses"),
        (FRAME, "frame"),
        *held,
        ("#000000", f"bar: {1e3 * SCALE_BAR:g} mm"),
    ]


def case_text(scene: Scene) -> str:
    """Tells what was simulated, in one line."""
    case = scene.scenario
    point = case.get("point")
    return (
        f"support: {str(case.get('support')).replace('_', ' ')}; ball {case.get('speed'):g} m/s,"
        f" {case.get('incidence_deg'):g}° from the normal,"
        f" {'aimed at the centre' if point == 'auto' else f'point {point}'}"
    )


def exaggeration_text(scene: Scene) -> str:
    """Tells how slow it is, and what is exaggerated by how much."""
    settings = scene.settings

    def times(factor: float) -> str:
        return "true to scale" if factor == 1.0 else f"magnified {factor:g} times"

    return (
        f"1/{settings.slowdown:g} of real speed; bending of the frame {times(settings.magnify)};"
        f" deflection of the strings {times(settings.magnify_strings)}"
    )


def finish_page(page: str, scene: Scene) -> str:
    """Gives Meshcat's static page our title and panel, and shuts it off from the network."""
    title = html.escape(scene.title)
    data = {
        "time": np.round(1e3 * scene.time, 4).tolist(),  # ms
        "force": np.round(scene.force, 1).tolist(),
        "bending": np.round(np.degrees(scene.bending), 3).tolist(),
        "contact": scene.in_contact.astype(int).tolist(),
        "fps": scene.fps,
    }
    panel = files("drake_racket.animation").joinpath("panel.html").read_text(encoding="utf-8")
    entries = "".join(
        f'<li><span style="background:{colour}"></span>{html.escape(text)}</li>'
        for colour, text in legend(scene)
    )
    texts = {
        "title": title,
        "case": html.escape(case_text(scene)),
        "exaggeration": html.escape(exaggeration_text(scene)),
        "legend": entries,
        "data": json.dumps(data),
    }
    # in one pass: a title may itself hold such a mark
    panel = re.sub(r"{{(\w+)}}", lambda found: texts[found[1]], panel)
    head = f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n  '
    page = page.replace(_CONTROLLERS, "")
    page = page.replace("<title>Drake MeshCat</title>", f"{head}<title>{title}</title>", 1)
    before, body, after = page.rpartition("</body>")
    return before + panel + body + after
