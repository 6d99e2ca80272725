"""What standards report of tests along and about axes: ISO 230-2 and ISO 230-4."""
