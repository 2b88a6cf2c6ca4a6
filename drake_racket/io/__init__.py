"""What comes in and goes out: numbers, files, tables, signals; and the one error of bad input."""
