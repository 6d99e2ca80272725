"""The volumetric error over the stroke, and compensation tables."""
