"""Drawings as SVG, made without a drawing library."""
