"""What is read over many campaigns: the runs and parameters of a machine and of the whole fleet, as lists."""
