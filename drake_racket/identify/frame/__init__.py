"""Fits of the throat joint to impact-hammer records."""
