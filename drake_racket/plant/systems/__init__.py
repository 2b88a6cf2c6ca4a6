"""The LeafSystems: string-bed, ball contact, load on the hand."""
