"""What a run gives: numbers, energy, time histories, and the files they are kept in."""
