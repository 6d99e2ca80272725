"""The 21 errors of three axes from an L of modules."""
