"""Makes a racket of what a shop prints: mass, balance, swingweight, head, stiffness."""
