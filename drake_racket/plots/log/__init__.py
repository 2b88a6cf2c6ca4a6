"""Figures from the time history of one impact."""
