"""Brings limbs of MuJoCo models into a plant."""
