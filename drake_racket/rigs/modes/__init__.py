"""Modal analysis of the frame."""
