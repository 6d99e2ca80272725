"""All machines at once: what needs attention, ranked."""
