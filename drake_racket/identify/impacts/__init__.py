"""Fits any parameters to numbers measured on whole impacts, of a free or a held racket."""
