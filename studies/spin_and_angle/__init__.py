"""What incidence, spin and friction make of a ball: speed, angle and spin after."""
