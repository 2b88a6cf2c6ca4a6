"""The inertia bench has knife-edges, a pendulum and a table."""
