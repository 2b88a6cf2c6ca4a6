"""Do the fits find again what made their data? Recovery tables and coverage of the intervals."""
