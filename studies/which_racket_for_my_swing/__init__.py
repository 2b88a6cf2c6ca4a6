"""Which racket for my swing: rackets by their shop rows, for swings from slow to fast."""
