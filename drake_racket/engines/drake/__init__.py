"""The reference engine runs on Drake's own plant, systems and integrators."""
