"""Statistics of the runs of a campaign."""
