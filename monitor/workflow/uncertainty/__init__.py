"""Uncertainty of a run's results after JCGM 102:2011."""
