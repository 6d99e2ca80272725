"""Forecasts of parameters and of the longest error vector, and their backtests."""
