"""Knife-edges, pendulum and table: the inertia bench."""
