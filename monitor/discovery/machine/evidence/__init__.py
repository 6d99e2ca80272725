"""What counts as evidence for an effect of a machine: poses, runs and days, readings that are left out in turn."""
