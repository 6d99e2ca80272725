"""The answers to the questions about calibration certificates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Any

from monitor.documents import INLINED, OMITTED
from monitor.reporting.signature.long_term import LongTermMaterial


@dataclass(frozen=True)
class CertificateState:
    """A certificate's present state; ``campaign_withdrawn`` says why its campaign no longer counts."""

    number: str
    state: str
    campaign: str
    campaign_withdrawn: str | None
    runs: tuple[int, ...]
    sha256: str
    software_version: str
    reason: str | None
    replaced_by: str | None


@dataclass(frozen=True)
class CertificateShowAnswer:
    """A certificate's state and its stored record: a ``CertificateRecord`` with ``CertificateInputs``, as written."""

    certificate: CertificateState = field(metadata=INLINED)
    record: Mapping[str, Any]


@dataclass(frozen=True)
class CertificatesAnswer:
    """All certificates in their present state."""

    certificates: tuple[CertificateState, ...]


@dataclass(frozen=True)
class CertificateFileAnswer:
    """A certificate's state and the file that was written; ``notes`` name other certificates of
    the same runs that are in force, and what the laboratory's file says in vain."""

    certificate: CertificateState = field(metadata=INLINED)
    file: str
    notes: tuple[str, ...] | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class RemakeAnswer:
    """Whether a certificate that was made again is the stored one, byte for byte; ``why`` not, where it is not."""

    certificate: CertificateState = field(metadata=INLINED)
    identical: bool
    signed: bool
    file: str | None
    why: str | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class CertificateChecks:
    """What a file was checked for; ``signature`` is None where it has none.

    ``hash``: this database knows its content; ``chain``: the database is as written; ``database``: the certificate is
    issued and its campaign counts; ``expected``: the file has the hash that was noted elsewhere, None where none was.
    """

    hash: bool
    chain: bool
    signature: bool | None
    database: bool
    expected: bool | None = field(default=None, metadata=OMITTED)

    @property
    def passed(self) -> bool:
        """Whether nothing failed."""
        return all(
            (self.hash, self.chain, self.signature is not False, self.database, self.expected is not False)
        )


class Verdict(StrEnum):
    """What may be said of a file: genuine is only what a trusted signer signed.

    Whoever may write the database can make a record that a file of his own matches.
    """

    GENUINE = "genuine"
    NOT_SIGNED = "not signed"
    SIGNER_NOT_TRUSTED = "signer not trusted"
    NOT_CONFIRMED = "not confirmed"


@dataclass(frozen=True)
class VerificationAnswer:
    """Whether a file is a valid certificate of this database, by its ``verdict`` a genuine one; ``faults`` say why not.

    ``signer_sha256`` is the fingerprint of the signer's certificate, None where the file is not signed; ``stamped_at``
    when a time stamp authority saw the signature, ``long_term`` what the file carries to be judged by later,
    ``judged_until`` when it ceases to prove by itself who signed it: from then on the record of the database does.
    """

    number: str | None
    ok: bool
    state: str | None
    checks: CertificateChecks
    signer: str | None
    faults: tuple[str, ...]
    signer_sha256: str | None = None
    stamped_at: datetime | None = field(default=None, metadata=OMITTED)
    verdict: Verdict = Verdict.NOT_CONFIRMED
    long_term: LongTermMaterial | None = field(default=None, metadata=OMITTED)
    judged_until: datetime | None = field(default=None, metadata=OMITTED)
