"""Has the equations of motion of a model: from a state to its rates, in machine code."""
