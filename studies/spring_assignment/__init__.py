"""Which string spring carries which of k1-k4 and p1-p6? Every assignment, ranked."""
