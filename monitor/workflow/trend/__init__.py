"""The trend of each parameter of a machine."""
