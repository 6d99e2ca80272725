from monitor.api import (
    Answer as Answer,
    Campaign as Campaign,
    Database as Database,
    Machine as Machine,
    Pictures as Pictures,
    open as open,
    read as read,
    simulate as simulate,
)

__version__: str
__all__ = ["Answer", "Campaign", "Database", "Machine", "Pictures", "open", "read", "simulate"]
