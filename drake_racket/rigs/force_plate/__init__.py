"""This rig shoots a ball at a force plate."""
