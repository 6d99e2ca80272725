"""The past of a machine: runs, series, changes, drift."""
