"""One resolved case, and the Diagram that it runs in."""
