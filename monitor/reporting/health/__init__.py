"""The weekly health report: its records and pages."""
