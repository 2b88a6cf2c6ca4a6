"""Reads and checks the parameter files: racket, ball, grip, limb, scenario."""
