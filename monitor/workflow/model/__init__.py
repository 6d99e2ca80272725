"""Models and their versions: list, show, add and remove effects."""
