"""Does a looser string-bed give more speed? Stringing tension over 180-330 N, free and clamped."""
