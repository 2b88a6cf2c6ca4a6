"""The commands that make, change and compare rackets."""
