"""Limbs of files: SDF, URDF, model directives; their ties, and joints that are locked."""
