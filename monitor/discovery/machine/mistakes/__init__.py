"""Mistakes of the file: exchanged columns and targets, signs, units, and what undoes each."""
