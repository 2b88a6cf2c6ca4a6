"""Racket, ball and hand on a MultibodyPlant, and the systems that drive them."""
