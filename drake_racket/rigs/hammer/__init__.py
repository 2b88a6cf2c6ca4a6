"""The impact hammer on a freely suspended frame."""
