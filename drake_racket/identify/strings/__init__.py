"""Fits string-bed and friction to restitution and angle tables."""
