"""Which string-bed parameters restitution determines, and what would settle the others."""
