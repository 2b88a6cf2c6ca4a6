"""The hammer rig strikes a freely suspended frame with the impact hammer."""
