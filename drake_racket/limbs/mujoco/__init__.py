"""Limbs of MuJoCo models, brought into a plant."""
