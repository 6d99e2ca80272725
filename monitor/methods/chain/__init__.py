"""Least squares on a kinematic chain: what the methods share."""
