"""Three sweet spots: most restitution, least vibration, least shock at the hand."""
