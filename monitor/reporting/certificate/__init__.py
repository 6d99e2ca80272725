"""The calibration certificate: its record, its pages, its digital form."""
