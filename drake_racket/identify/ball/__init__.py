"""Fits kb and cb to force-plate records."""
