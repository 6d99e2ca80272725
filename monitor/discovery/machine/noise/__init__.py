"""The noise of the readings of a machine: which belong together, and how those of one run resemble each other."""
