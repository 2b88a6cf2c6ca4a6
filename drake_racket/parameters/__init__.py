"""The parameter files and their schemas: racket, ball, grip, limb, scenario."""
