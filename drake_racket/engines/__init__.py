"""What turns a case into a trajectory: Drake itself, or loops that are compiled."""
