"""Named selections of runs: made by a condition, used as a group, set side by side."""
