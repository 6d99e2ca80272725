"""Publishing what a plant stored to a lake that holds many plants."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from monitor.exceptions import InputError
from monitor.progress import told
from monitor.store import Database
from monitor.store.lake.attaching import check_lake_address
from monitor.store.lake.publication import publish as publish_to


@dataclass(frozen=True)
class PublishRequest:
    """The address of a lake; ``files`` is the folder of the Parquet files of a new one, or ``s3://BUCKET/FOLDER``
    in an object store; ``plant`` names this database.

    Raises InputError for what is no address, holds a password, or a name without a letter.
    """

    to: str
    files: str | None = None
    plant: str | None = None

    def __post_init__(self) -> None:
        check_lake_address(self.to)
        if self.plant is not None and (not self.plant.strip() or "@" in self.plant):
            raise InputError(f"--plant '{self.plant}': a name without @, such as --plant Ulm")


@dataclass(frozen=True)
class PublishAnswer:
    """What was added to the lake, and the last entry of this database's audit that it holds now.

    ``plant`` is the database's name there; ``tries`` says how often a transaction was begun.
    """

    plant: str
    entries: int
    rows: int
    last_entry: int
    last_sha256: str
    tries: int


def publish(
    db: Database, request: PublishRequest, progress: Callable[[str], None] = lambda fault: None
) -> PublishAnswer:
    """Add everything that was stored since the last publication; nothing twice, whatever happened before.

    ``progress`` is told why a transaction is tried again for long. Raises StoreError where the lake cannot be reached
    or the database has another past than it published.
    """
    published = publish_to(
        db,
        request.to,
        files=request.files,
        plant=request.plant,
        progress=lambda last, end: told(last / end),
        away=progress,
    )
    return PublishAnswer(
        published.plant,
        published.entries,
        published.rows,
        published.last_entry,
        published.last_sha256,
        published.tries,
    )
