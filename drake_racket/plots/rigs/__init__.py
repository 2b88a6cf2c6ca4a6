"""Draws figures of the paper's experiments."""
