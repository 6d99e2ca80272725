"""Control charts of one parameter and of the vector of all, with their limits."""
