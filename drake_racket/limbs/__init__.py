"""Limbs hold a racket: the shipped one, those of files, and those of MuJoCo models."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
