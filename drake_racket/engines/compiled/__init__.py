"""The compiled engine reads a Diagram into flat arrays and integrates it in machine code."""
