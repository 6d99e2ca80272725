"""Tells what looks like a mistake in a campaign folder, without a fit and without refusing it."""
