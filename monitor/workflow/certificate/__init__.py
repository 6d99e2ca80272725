"""Calibration certificates."""
