"""The reference engine: Drake's own plant, systems and integrators."""
