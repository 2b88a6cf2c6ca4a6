"""Instances of system templates, made without the half second that Drake's look-up takes."""

from __future__ import annotations

import threading
from typing import Any


def on_float(template: Any) -> Any:
    """Gives the system of a TemplateSystem on float, as `template[float]`.

    Drake looks for the module that a template belongs to through the whole call stack, source lines
    included: 0.05 s a time below a test runner or a command line, fourteen times. A thread of its
    own has a short stack.
    """
    made: list[Any] = []
    thread = threading.Thread(target=lambda: made.append(template[float]))
    thread.start()
    thread.join()
    return made[0] if made else template[float]  # which raises what the thread could not
