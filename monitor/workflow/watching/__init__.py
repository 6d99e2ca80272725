"""Looks at a folder for campaigns that came, and does with each what its owner would type."""
