"""The LeafSystems are string-bed, ball contact, and load on the hand."""
