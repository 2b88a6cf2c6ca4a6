"""The shipped upper limb: its table of numbers, and a picture of its joints and frames."""
