"""Single readings, balls, runs and instruments of a machine that deviate on their own, and steps between runs."""
