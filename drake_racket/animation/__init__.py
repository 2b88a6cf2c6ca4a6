"""Animations of one impact from its history alone: `animate` writes a page (HTML) or a film."""

from drake_racket.animation.settings import AnimationSettings
from drake_racket.animation.write import animate

__all__ = ["AnimationSettings", "animate"]
