"""Puts racket, ball and hand on a MultibodyPlant, with the systems that drive them."""
