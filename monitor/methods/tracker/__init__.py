"""Reflectors on a robot or serial machine, seen from outside."""
