"""This rig is the modal analysis of the frame."""
