"""Which kb and cb at 18 m/s agree with the published bounds, as a map with the default on it."""
