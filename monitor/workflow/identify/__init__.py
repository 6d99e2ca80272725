"""The geometric errors of every run of a campaign."""
