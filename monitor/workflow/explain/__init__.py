"""Model against measurement, and which physical effect is missing."""
