"""The clamped engine runs head-clamped impacts, many at once, with exact derivatives."""
