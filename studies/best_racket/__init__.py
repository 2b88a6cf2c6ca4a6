"""The best racket: where mass, tension and stiffness go for the fastest ball."""
