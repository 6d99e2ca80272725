"""Missing effects of a machine."""
