"""The force plate rig shoots a ball at a force plate."""
