"""Curves of rotary joints that have several lines, and the search beside them."""
