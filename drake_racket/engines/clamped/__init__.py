"""The engine of head-clamped impacts: many at once, with exact derivatives."""
