"""Strings or frame: what changes the load on hand and arm more."""
