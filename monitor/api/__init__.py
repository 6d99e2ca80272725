"""The Python interface: ``import monitor as mm; db = mm.open("shop.duckdb")``. A thin face of ``workflow``.

``open`` gives a ``Database``; its ``campaign(name)`` a ``Campaign``. What they answer is an ``Answer``: the typed
answer of the contract, as a table, a document or pictures. ``read`` looks at a campaign folder without storing it,
``simulate`` writes a virtual one, ``Machine`` is the kinematic model alone.
"""

from monitor.api.answer import Answer
from monitor.api.campaign import Campaign
from monitor.api.database import Database, open, simulate
from monitor.api.folder import read
from monitor.api.machine import Machine
from monitor.api.pictures import Pictures

__all__ = ["Answer", "Campaign", "Database", "Machine", "Pictures", "open", "read", "simulate"]
