"""What each instrument does for each parameter of a machine, and whether the instruments agree."""
