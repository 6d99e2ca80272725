"""Material for long-term validation inside a signed file: PAdES baseline B-LT (ETSI EN 319 142-1:2016, 5.4 and 6).

The certificates that signer and time stamp lead to, and what their authorities said of each of them when it was signed
(revocation lists after RFC 5280, answers after RFC 6960), stand in the document security store, in the same revision as
the signature, which so covers them. Years later, when the authorities no longer answer, a reader still finds there that
both certificates were in force. By pyHanko, an optional extra.
"""

from __future__ import annotations

from contextlib import AbstractAsyncContextManager, aclosing
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from monitor.documents import OMITTED
from monitor.exceptions import InputError
from monitor.reporting.signature.trust import TrustedSigners, read_trusted

#: No certificate below a root passes of which nothing says that it was not revoked.
_REVOCATION = "require"
#: An answer that was fetched before the stamp may bear its second, or that after it where two clocks differ so much.
_CLOCKS = timedelta(seconds=10)


@dataclass(frozen=True)
class LongTermMaterial:
    """What a file carries for its later validation: how many ``certificates``, ``revocation_lists`` and ``answers`` of
    authorities (OCSP).

    ``complete`` says whether by these alone signer and time stamp lead to trusted certificates that were in force at
    the time of the stamp; None where nobody was named as trusted, or by fingerprints alone. ``why_not`` is the first
    reason against. ``until`` is when the first of the certificates ends that the time stamp leads to: from then on it
    proves nothing by itself. None where it is not complete.
    """

    certificates: int
    revocation_lists: int
    answers: int
    complete: bool | None = None
    why_not: str = ""
    until: datetime | None = field(default=None, metadata=OMITTED)


def fetching_context(roots_file: Path) -> AbstractAsyncContextManager[Any]:
    """Return the context in which a signature is made B-LT: what it needs is fetched from the addresses that the
    certificates themselves name.

    Raises InputError where ``roots_file`` cannot be read, or names no certificates.
    """
    from pyhanko_certvalidator import ValidationContext

    roots = read_trusted(roots_file).roots
    if not roots:
        raise InputError(
            f"{roots_file} holds fingerprints: long-term material needs the certificates of the authorities (PEM, DER)"
        )
    return aclosing(
        ValidationContext(trust_roots=list(roots), allow_fetching=True, revocation_mode=_REVOCATION)
    )


def together_with_signature() -> Any:
    """Return where the material goes: into the revision of the signature, without a list of it by signature (VRI)."""
    from pyhanko.sign.signers.pdf_signer import DSSContentSettings, SigDSSPlacementPreference

    return DSSContentSettings(include_vri=False, placement=SigDSSPlacementPreference.TOGETHER_WITH_SIGNATURE)


def material_in(
    reader: Any, signature: Any, signers: TrustedSigners, stamped_at: datetime | None
) -> LongTermMaterial | None:
    """Return the material of a file and whether it suffices; None where it has none.

    ``reader`` and ``signature`` are pyHanko's; ``stamped_at`` is the time of the stamp, at which both certificates are
    judged, without asking anybody.
    """
    from pyhanko.sign.validation import validate_pdf_signature
    from pyhanko.sign.validation.dss import DocumentSecurityStore
    from pyhanko.sign.validation.errors import NoDSSFoundError

    try:
        store = DocumentSecurityStore.read_dss(reader)
    except NoDSSFoundError:
        return None
    counted = len(store.certs), len(store.crls), len(store.ocsps)
    if stamped_at is None:
        return LongTermMaterial(*counted, False, "there is no time stamp at which it could be judged")
    if not signers.roots:
        return LongTermMaterial(*counted)

    def context() -> Any:
        return store.as_validation_context(
            {
                "trust_roots": list(signers.roots),
                "allow_fetching": False,
                "moment": stamped_at,
                "time_tolerance": _CLOCKS,
                "revocation_mode": _REVOCATION,
            }
        )

    status = validate_pdf_signature(
        signature, signer_validation_context=context(), ts_validation_context=context()
    )
    stamp = status.timestamp_validity
    checks = (
        (status.trusted, f"the certificate of the signer: {_reason(status)}"),
        (stamp is not None and stamp.trusted, f"the certificate of the time stamp: {_reason(stamp)}"),
    )
    faults = [fault for passed, fault in checks if not passed]
    if faults:
        return LongTermMaterial(*counted, False, faults[0])
    return LongTermMaterial(*counted, True, until=_first_end(stamp))


def _first_end(status: Any) -> datetime:
    """Return when the first certificate of a judged one's path ends; its root is trusted by itself."""
    path = status.validation_path
    below_root = [] if path is None else list(path)[1:]
    ends: list[datetime] = [certificate.not_valid_after for certificate in [status.signing_cert, *below_root]]
    return min(ends)


def _reason(status: Any) -> str:
    """Return why a certificate is not trusted, by the sub-indication of ETSI EN 319 102-1 where there is one."""
    problem = getattr(status, "trust_problem_indic", None)
    if problem is None:
        return "it does not lead to a trusted one by the material in the file"
    return str(problem.name).lower().replace("_", " ")
