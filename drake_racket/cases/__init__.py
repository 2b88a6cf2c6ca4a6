"""A case is one impact, resolved; here it is made, and the Diagram that it runs in."""
