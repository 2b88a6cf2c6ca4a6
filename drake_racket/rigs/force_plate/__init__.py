"""A ball on a force plate."""
