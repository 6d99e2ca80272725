"""The signatures of all certificates that a database keeps, each judged on the day on which it was stored."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC
from pathlib import Path

from monitor.reporting.signature.signature import SignatureFinding, check_signature, is_signed
from monitor.reporting.signature.trust import read_trusted
from monitor.store import Database, certificate_numbers, load_certificate


def stored_signatures(db: Database, trusted: Path) -> Iterator[tuple[str, SignatureFinding]]:
    """Yield number and finding of every certificate whose document bears a signature.

    Raises InputError for a file of signers that cannot be read as such, although nothing may be signed.
    """
    read_trusted(trusted)
    for number in certificate_numbers(db):
        stored = load_certificate(db, number)
        if is_signed(stored.pdf):
            yield number, check_signature(stored.pdf, trusted, stored.made_at.replace(tzinfo=UTC))
