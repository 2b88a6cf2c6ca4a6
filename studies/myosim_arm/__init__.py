"""MyoSim's right arm, brought from MuJoCo into a Drake plant and compared with MuJoCo itself."""
