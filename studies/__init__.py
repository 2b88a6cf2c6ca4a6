"""The studies: each one question, with its figures and its numbers."""
