"""Where to put ten grams: one place after the other, and what each changes."""
