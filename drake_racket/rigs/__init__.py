"""The laboratory: one module per experiment. A rig sets a test up as the source did and runs it."""
