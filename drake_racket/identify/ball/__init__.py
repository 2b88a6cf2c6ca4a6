"""Fits of kb and cb to force-plate records."""
