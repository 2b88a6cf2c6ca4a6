"""The study that asks how many segments of a frame a stroke needs."""
