"""The best stroke: how the shipped arm swings for the fastest ball, also off centre."""
