"""What the standards of machine tools report of a campaign: ISO 230-2, -4, -6, -7, ISO 10791-6 and -7."""
