"""Signs a certificate: PAdES baseline B-B, with a time stamp B-T, with long-term material (``long_term``) B-LT (ETSI EN
319 142-1:2016, 6), by pyHanko, an extra.

With a ``FileKey`` (PKCS#12 file, extra ``sign``) or a ``TokenKey`` (PKCS#11: smart card, hardware module; extra
``token``), whose private key never leaves the token. The signature is appended to the PDF, which stays as it was below
it: PDF/A, its attachments, every byte. It certifies the document: no change is allowed afterwards.
"""

from __future__ import annotations

import asyncio
import io
import logging
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from monitor.bounded import LARGEST_DOCUMENT, read_bounded
from monitor.exceptions import InputError
from monitor.reporting.signature.field import NAME, field_drawing, place_in
from monitor.reporting.signature.long_term import fetching_context, together_with_signature
from monitor.reporting.signature.signature import need_pyhanko, signer_in
from monitor.reporting.signature.signer import Signer

#: Bytes reserved for the signature itself; a certificate chain of three with RSA 4096 needs about 12 000.
_ROOM_BYTES = 32_768
#: How long an authority may take for a time stamp, in seconds.
_WAIT_S = 20


@dataclass(frozen=True)
class FileKey:
    """The key and certificates of a PKCS#12 file."""

    path: Path
    passphrase: str | None = None


@dataclass(frozen=True)
class TokenKey:
    """A key on a PKCS#11 token: the ``library`` of the token's maker, the token by ``slot`` or label, the key by label.

    ``certificate`` is the label of the signer's certificate on the token (that of the key where None); all other
    certificates on the token go along. ``pin`` opens the token; without one the token has a PIN pad of its own.
    """

    library: Path
    key: str
    token: str | None = None
    slot: int | None = None
    certificate: str | None = None
    pin: str | None = None


Key = FileKey | TokenKey


def sign(pdf: bytes, key: Key, timestamp_url: str | None = None, long_term: Path | None = None) -> bytes:
    """Return the PDF with a signature by ``key``, and a time stamp of the authority at an address (RFC 3161).

    The authority gets the hash of the signature, and nothing of the document. ``long_term`` is a file of certificates
    that signer and time stamp lead to: what their authorities say of them now is fetched and goes along.

    Raises InputError where an authority gives no time stamp or nothing that the certificates could be judged by, where
    the extra is not installed, the key cannot be opened, or is not there, and where its certificate is not valid today.
    """
    need_pyhanko()
    from pyhanko.sign import timestamps
    from pyhanko.sign.general import SigningError
    from pyhanko_certvalidator.errors import PathError, ValidationError

    logging.getLogger("pyhanko").setLevel(logging.CRITICAL)
    logging.getLogger("pyhanko_certvalidator").setLevel(logging.CRITICAL)
    with _opened(key) as signer:
        _check_in_force(signer.signing_cert)
        try:
            return asyncio.run(_signed(pdf, signer, timestamp_url, long_term))
        except (timestamps.TimestampRequestError, OSError) as error:
            if timestamp_url is None:
                raise
            raise InputError(
                f"the time stamp authority {timestamp_url} gave no time stamp: {_why(error)}; nothing was issued"
            ) from error
        except (SigningError, PathError, ValidationError) as error:
            if long_term is None:
                raise
            raise InputError(
                f"the certificates of signer and time stamp cannot be judged by {long_term} and what their authorities "
                f"say: {_why(error.__cause__ or error)}; nothing was issued"
            ) from error


async def _signed(pdf: bytes, signer: Any, timestamp_url: str | None, long_term: Path | None) -> bytes:
    """Return the signed PDF. Raises what pyHanko raises, and InputError for the file of ``long_term``."""
    from pyhanko.pdf_utils.content import RawContent
    from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter
    from pyhanko.pdf_utils.layout import BoxConstraints
    from pyhanko.sign import fields, signers, timestamps
    from pyhanko.stamp import StaticStampStyle

    stamper = None if timestamp_url is None else timestamps.HTTPTimeStamper(timestamp_url, timeout=_WAIT_S)
    out = io.BytesIO()
    writer = IncrementalPdfFileWriter(io.BytesIO(pdf))
    spot = place_in(writer.prev)
    visible: dict[str, Any] = {}
    if spot is not None:
        x0, y0, x1, y1 = spot.box
        content = field_drawing(signer_in(signer.signing_cert).common_name, datetime.now(UTC))
        drawing = RawContent(content, box=BoxConstraints(x1 - x0, y1 - y0))
        visible = {
            "new_field_spec": fields.SigFieldSpec(NAME, on_page=spot.page, box=spot.box),
            "stamp_style": StaticStampStyle(
                border_width=0, background=drawing, background_layout=_filling_the_field()
            ),
        }
    async with nullcontext() if long_term is None else fetching_context(long_term) as context:
        meta = signers.PdfSignatureMetadata(
            field_name=NAME,
            md_algorithm="sha256",
            subfilter=fields.SigSeedSubFilter.PADES,
            certify=True,
            docmdp_permissions=fields.MDPPerm.NO_CHANGES,
            validation_context=context,
            embed_validation_info=context is not None,
            dss_settings=together_with_signature(),
        )
        pdf_signer = signers.PdfSigner(meta, signer, timestamper=stamper, **visible)
        await pdf_signer.async_sign_pdf(writer, output=out, bytes_reserved=_ROOM_BYTES)
    return out.getvalue()


def _filling_the_field() -> Any:
    """Return pyHanko's rule for a drawing that fills its field; by itself it leaves ten points at each side."""
    from pyhanko.pdf_utils.layout import AxisAlignment, Margins, SimpleBoxLayoutRule

    middle = AxisAlignment.ALIGN_MID
    return SimpleBoxLayoutRule(middle, middle, Margins(0, 0, 0, 0))


def signer_of(key: Key) -> Signer:
    """Return who signs with ``key``, as its certificate says. Raises what ``sign`` raises."""
    need_pyhanko()
    with _opened(key) as signer:
        _check_in_force(signer.signing_cert)
        return signer_in(signer.signing_cert)


def _opened(key: Key) -> AbstractContextManager[Any]:
    return _token_signer(key) if isinstance(key, TokenKey) else _file_signer(key)


def _check_in_force(certificate: Any) -> None:
    """Raise InputError for a certificate that has ended or not begun: no reader accepts its signatures."""
    first, last, today = certificate.not_valid_before, certificate.not_valid_after, datetime.now(UTC)
    if not first <= today <= last:
        raise InputError(
            f"the signing certificate of {certificate.subject.human_friendly} is valid from {first:%Y-%m-%d} to "
            f"{last:%Y-%m-%d}, not today ({today:%Y-%m-%d}); sign with one that is"
        )


@contextmanager
def _file_signer(key: FileKey) -> Iterator[Any]:
    from pyhanko.sign import signers

    try:
        content = read_bounded(key.path, LARGEST_DOCUMENT)
    except OSError as error:
        raise InputError(f"the key file {key.path} cannot be read: {error.strerror or error}") from error
    passphrase = None if key.passphrase is None else key.passphrase.encode()
    try:
        signer = signers.SimpleSigner.load_pkcs12_data(content, other_certs=[], passphrase=passphrase)
    except Exception:  # the library below raises by kind of fault; all mean the same to the user
        signer = None
    if signer is None:
        hint = "; --passphrase-file FILE names the file with its passphrase" if key.passphrase is None else ""
        raise InputError(f"{key.path} is no PKCS#12 file with a key, or its passphrase is another{hint}")
    yield signer


@contextmanager
def _token_signer(key: TokenKey) -> Iterator[Any]:
    try:
        import pkcs11
        from pyhanko.config.pkcs11 import TokenCriteria
        from pyhanko.sign.pkcs11 import PKCS11Signer, open_pkcs11_session
    except ImportError as error:
        raise InputError(
            "keys on a token need python-pkcs11: pip install 'machine-health-monitor[token]'"
        ) from error
    if not key.library.is_file():
        raise InputError(f"there is no PKCS#11 library {key.library}; the token's maker has one")
    if (key.token is None) == (key.slot is None):
        raise InputError("name the token either by its label (--token-label) or by its slot (--token-slot)")
    named = f"slot {key.slot}" if key.token is None else f"token {key.token!r}"
    try:
        session = open_pkcs11_session(
            str(key.library),
            slot_no=key.slot,
            token_criteria=None if key.token is None else TokenCriteria(label=key.token),
            user_pin=key.pin if key.pin is not None else pkcs11.PROTECTED_AUTH,
        )
    except Exception as error:  # python-pkcs11 has an exception a return code of the token
        raise InputError(f"{named} of {key.library.name} does not open: {_why(error)}") from error
    with session:
        signer = PKCS11Signer(
            session, key_label=key.key, cert_label=key.certificate or key.key, other_certs_to_pull=None
        )
        try:
            # Many tokens, SoftHSM among them, sign with elliptic curves only what was hashed before.
            signer.use_raw_mechanism = signer.signing_cert.public_key.algorithm == "ec"
            yield signer
        except pkcs11.PKCS11Error as error:
            raise InputError(f"{named} does not sign with {key.key!r}: {_why(error)}") from error


def _why(error: BaseException) -> str:
    """Return the message of a token; its errors are mostly the names of return codes, such as PinIncorrect."""
    message = str(error).strip()
    return f"{type(error).__name__}: {message}" if message else type(error).__name__
