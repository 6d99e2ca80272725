"""Propagation of distributions by Monte Carlo: joint distributions, blocks of trials, the adaptive procedure."""
