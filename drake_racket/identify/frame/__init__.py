"""Fits the throat joint to impact-hammer records."""
