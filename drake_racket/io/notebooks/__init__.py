"""What notebooks show: tables in place of one-line texts, and bars of progress."""
