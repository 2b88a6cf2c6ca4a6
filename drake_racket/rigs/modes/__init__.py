"""The modal analysis finds the frame's frequencies, damping and shapes."""
