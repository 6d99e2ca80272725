"""Where tasks are done: processes of this machine or workers of a cluster, with the same numbers."""
