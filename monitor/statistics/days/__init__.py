"""Tests of differences between days that hold whatever makes days differ."""
