"""Draws figures from the time history of one impact."""
