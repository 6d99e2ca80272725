"""What the standards of machine tools report of a campaign: ISO 230-2, ISO 230-4, ISO 230-6."""
