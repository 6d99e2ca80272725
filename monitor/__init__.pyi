from monitor.api import Answer as Answer
from monitor.api import Campaign as Campaign
from monitor.api import Database as Database
from monitor.api import Machine as Machine
from monitor.api import Pictures as Pictures
from monitor.api import open as open
from monitor.api import read as read
from monitor.api import simulate as simulate

__version__: str
__all__ = ["Answer", "Campaign", "Database", "Machine", "Pictures", "open", "read", "simulate"]
