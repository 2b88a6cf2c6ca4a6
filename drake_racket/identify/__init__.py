"""Fits the model's parameters to measurements."""
