"""Reads the parts of a campaign folder: the tables of ``campaign.toml``, ``runs.csv``, ``probings.csv`` and curves."""
