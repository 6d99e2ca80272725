"""The weekly health report."""
