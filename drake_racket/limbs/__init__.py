"""Limbs that hold a racket: the shipped one, imported ones, and the state they strike in."""
