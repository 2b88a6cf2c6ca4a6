"""Derivatives of a compiled run: tangents of its path, made from the same source."""
