"""Missing effects of a curve."""
