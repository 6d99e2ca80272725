"""Numbered SQL files, forward only: installed as ``monitor.migrations``."""
