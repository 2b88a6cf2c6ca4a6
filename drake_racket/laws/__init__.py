"""The laws of the model as pure functions: they run on floats, on AutoDiffXd and compiled."""
