"""Templates, style sheet and fonts: installed as ``monitor.reports``."""
