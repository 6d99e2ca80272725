"""What each calibration method asks of a campaign folder: one file a method, found by its ``RULES``."""
