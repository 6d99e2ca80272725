"""One run as a measurement model: its inputs, its compiled program, its sensitivity."""
