"""What decides ball speed, wrist load and mid-handle vibration: Sobol indices."""
