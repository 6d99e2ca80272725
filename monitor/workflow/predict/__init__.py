"""What a fitted model says of readings that took no part in its fit."""
