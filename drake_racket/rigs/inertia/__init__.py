"""This rig is the inertia bench: knife-edges, pendulum and table."""
