"""Plans of measurements before anyone measures."""
