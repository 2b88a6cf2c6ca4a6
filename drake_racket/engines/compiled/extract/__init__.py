"""Reads a model from a finalized plant, its Context and the systems beside it."""
