"""A run gives what is here: numbers, energy, time histories, and the files they are kept in."""
