"""The life of certificates: signed, altered, killed in the middle, replaced by another, withdrawn."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, date, datetime, timedelta
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pypdf
import pytest

from monitor.documents import from_document
from monitor.exceptions import InputError
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.reporting.certificate.dcc import dcc_xml
from monitor.reporting.certificate.dcc_elements import DCC
from monitor.reporting.certificate.record import CertificateRecord, Replaced
from monitor.reporting.pdf.render import certificate_pdf
from monitor.reporting.signature.signature import SignatureFinding, check_signature
from monitor.reporting.signature.signer import Signer
from monitor.reporting.signature.signing import FileKey, sign
from monitor.store import Database, import_campaign, list_certificates, load_certificate
from monitor.workflow.certificate import issue as certificates
from monitor.workflow.certificate.answer import CertificateChecks, Verdict
from monitor.workflow.certificate.files import prepared, publish
from monitor.workflow.certificate.issue import issue, withdraw
from monitor.workflow.certificate.remaking import remake
from monitor.workflow.certificate.request import (
    CertificateFileRequest,
    CertificateRequest,
    RemakeRequest,
    VerificationRequest,
    WithdrawalRequest,
)
from monitor.workflow.certificate.states import write_issued
from monitor.workflow.certificate.verification import verify_file
from monitor.workflow.keeping import VerifyRequest, verify
from monitor.workflow.uncertainty.evaluation import uncertainty
from monitor.workflow.uncertainty.request import UncertaintyRequest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LABORATORY = EXAMPLES / "laboratory.toml"
DAY = date(2026, 3, 12)


def other_machine() -> Campaign:
    campaign = read_campaign(EXAMPLES / "five-days")
    # With readings of its own: those of a copy have no certificate.
    readings = {axis: values + 1e-6 for axis, values in campaign.probings.readings.items()}
    probings = replace(campaign.probings, readings=readings)
    return replace(campaign, name="other", machine=replace(campaign.machine, id="M"), probings=probings)


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    with Database(tmp_path_factory.mktemp("life") / "c.duckdb", threads=1) as opened:
        import_campaign(opened, read_campaign(EXAMPLES / "five-days"))
        # Evaluated once: every certificate below states this result.
        uncertainty(opened, UncertaintyRequest("five-days", 20, method="guf"))
        yield opened


def fingerprint_of(key: FileKey) -> str:
    """The SHA-256 of the signer's certificate in an open PKCS#12 file, by another library than the product's."""
    from cryptography.hazmat.primitives import hashes
    from cryptography.hazmat.primitives.serialization import pkcs12

    _, certificate, _ = pkcs12.load_key_and_certificates(key.path.read_bytes(), None)
    assert certificate is not None
    return certificate.fingerprint(hashes.SHA256()).hex()


@pytest.fixture(scope="module")
def key(tmp_path_factory: pytest.TempPathFactory) -> FileKey:
    """The key of a made-up laboratory."""
    pytest.importorskip("pyhanko", reason="the extra [sign] is not installed")
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes
    from cryptography.hazmat.primitives.asymmetric import rsa
    from cryptography.hazmat.primitives.serialization import NoEncryption, pkcs12

    secret = rsa.generate_private_key(public_exponent=65537, key_size=2048)
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "Made-up Laboratory")])
    now = datetime.now(UTC)
    certificate = (
        x509.CertificateBuilder().subject_name(name).issuer_name(name).public_key(secret.public_key()).serial_number(1)
        .not_valid_before(now - timedelta(days=1)).not_valid_after(now + timedelta(days=9))
        .add_extension(x509.KeyUsage(True, True, *[False] * 7), critical=True)
        .sign(secret, hashes.SHA256())
    )  # fmt: skip
    file = tmp_path_factory.mktemp("key") / "lab.p12"
    file.write_bytes(pkcs12.serialize_key_and_certificates(b"lab", secret, certificate, None, NoEncryption()))
    return FileKey(file)


@pytest.mark.slow
def test_one_byte_changed_at_200_random_places_is_found_by_the_hash_and_by_the_signature(
    db: Database, key: FileKey, tmp_path: Path, seeds: Callable[[int, int], range]
) -> None:
    made = issue(
        db,
        CertificateRequest(
            "five-days", 20, laboratory=LABORATORY, out=tmp_path, number="B-1", issued_on=DAY, key=key
        ),
    )
    genuine = Path(made.file).read_bytes()
    rng = np.random.default_rng(200)
    file = tmp_path / "altered.pdf"
    for place in rng.choice(len(genuine), 200, replace=False)[seeds(200, 40)]:
        altered = bytearray(genuine)
        altered[place] ^= 1 << int(rng.integers(0, 8))
        file.write_bytes(altered)
        found = verify_file(db, VerificationRequest(file))
        where = f"byte {place}: {found.faults}"
        # What fails is the file, by both of its seals; the database and its chain of entries are as they were.
        assert found.checks == CertificateChecks(hash=False, chain=True, signature=False, database=False), (
            where
        )
        assert found.ok is False
        assert any("no certificate of this database has the content" in fault for fault in found.faults), (
            where
        )
        assert any("altered" in fault or "does not" in fault for fault in found.faults[1:]), where


@pytest.mark.slow
def test_a_certificate_that_another_signs_than_it_states_is_not_confirmed(
    db: Database, key: FileKey, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(certificates, "signer_of", lambda _: Signer("Common Name: Somebody", "ab" * 32))
    issued = issue(
        db,
        CertificateRequest(
            "five-days", 20, laboratory=LABORATORY, out=tmp_path, number="S-3", issued_on=DAY, key=key
        ),
    )
    answer = verify_file(db, VerificationRequest(Path(issued.file)))
    assert answer.checks == CertificateChecks(hash=True, chain=True, signature=False, database=True)
    assert any("states that Common Name: Somebody" in fault for fault in answer.faults)


def test_a_signed_certificate_is_verified_check_by_check(db: Database, key: FileKey, tmp_path: Path) -> None:
    made = issue(
        db,
        CertificateRequest(
            "five-days", 20, laboratory=LABORATORY, out=tmp_path, number="S-1", issued_on=DAY, key=key
        ),
    )
    file = Path(made.file)
    good = verify_file(db, VerificationRequest(file))
    assert good.ok is True
    assert good.checks == CertificateChecks(hash=True, chain=True, signature=True, database=True)
    assert good.signer == "Common Name: Made-up Laboratory"
    # Who checks in years: the signer's certificate, and an entry of the audit that was the last one then, both on
    # paper.
    fingerprint = fingerprint_of(key)
    assert good.signer_sha256 == fingerprint
    page = "".join(pypdf.PdfReader(file).pages[-1].extract_text().split())
    assert fingerprint in page
    (anchor,) = re.findall(r"isnumber\d+;itsSHA-256is([0-9a-f]{64})", page)
    assert verify(db, VerifyRequest(anchor, recompute=0)).anchored_entry is not None
    # Genuine is what a trusted signer signed: by fingerprint, as it is printed with colons or without.
    assert good.verdict is Verdict.SIGNER_NOT_TRUSTED
    trusted = tmp_path / "signers.txt"
    trusted.write_text(f"# of 2026\n{fingerprint.upper()}  # ours\n")
    genuine = verify_file(db, VerificationRequest(file, trusted))
    assert (genuine.ok, genuine.verdict) == (True, Verdict.GENUINE)
    whole_database = verify(db, VerifyRequest(recompute=0, trusted=trusted))
    assert whole_database.signed_certificates == whole_database.trusted_signatures
    trusted.write_text(":".join(["ab"] * 32))
    stranger = verify_file(db, VerificationRequest(file, trusted))
    assert (stranger.ok, stranger.verdict) == (False, Verdict.NOT_CONFIRMED)
    assert stranger.faults == (
        "the certificate of Common Name: Made-up Laboratory does not lead to a trusted one",
    )
    assert f"certificate S-1: {stranger.faults[0]}" in verify(db, VerifyRequest(trusted=trusted)).faults
    assert remake(db, RemakeRequest("S-1")).identical is True
    whole = file.read_bytes()
    altered = bytearray(whole)
    altered[whole.index(b"stream", whole.index(b"/EmbeddedFile")) + 40] ^= 1
    file.write_bytes(bytes(altered))
    bad = verify_file(db, VerificationRequest(file))
    assert bad.ok is False
    assert bad.checks == CertificateChecks(hash=False, chain=True, signature=False, database=False)
    assert any("altered after it was signed" in fault for fault in bad.faults)
    assert any("it bears the number S-1, but differs" in fault for fault in bad.faults)
    # A forged copy with another good signature: the signature holds, the database does not know it.
    forged = tmp_path / "forged.pdf"
    record = from_document(CertificateRecord, load_certificate(db, "S-1").record)
    forged.write_bytes(sign(certificate_pdf(record), key))
    assert verify_file(db, VerificationRequest(forged)).checks == CertificateChecks(
        hash=False, chain=True, signature=True, database=False
    )
    # What no hash says: a genuine file that was withdrawn.
    file.write_bytes(whole)
    withdraw(db, WithdrawalRequest("S-1", "the bar was damaged"))
    late = verify_file(db, VerificationRequest(file))
    assert late.checks == CertificateChecks(hash=True, chain=True, signature=True, database=False)
    assert late.ok is False


def test_17025_7_8_8_a_withdrawn_draft_and_a_withdrawn_certificate_stay_what_they_are(
    db: Database, tmp_path: Path, pdf_unread
) -> None:
    with pdf_unread():
        issue(
            db,
            CertificateRequest(
                "five-days", 20, laboratory=LABORATORY, out=tmp_path, number="W-1", issued_on=DAY, draft=True
            ),
        )
    withdraw(db, WithdrawalRequest("W-1", "was only a try"))
    for number in ("W-1",):
        with pytest.raises(InputError, match=f"certificate {number} is withdrawn; that is final"):
            withdraw(db, WithdrawalRequest(number, "again"))
        with pytest.raises(InputError, match="is withdrawn; only an issued one can be replaced"):
            issue(
                db,
                CertificateRequest(
                    "five-days",
                    20,
                    laboratory=LABORATORY,
                    out=tmp_path,
                    issued_on=DAY,
                    replaces=number,
                    reason="x",
                ),
            )


def test_17025_7_8_8_3_an_amended_certificate_has_a_new_number_the_reason_and_names_the_old(
    db: Database, tmp_path: Path, pdf_unread
) -> None:
    with pdf_unread():
        issue(
            db,
            CertificateRequest(
                "five-days", 20, laboratory=LABORATORY, out=tmp_path, number="A-1", issued_on=DAY
            ),
        )
    with pytest.raises(InputError, match="say why certificate A-1 is replaced"):
        issue(
            db,
            CertificateRequest(
                "five-days",
                20,
                laboratory=LABORATORY,
                out=tmp_path,
                number="A-2",
                issued_on=DAY,
                replaces="A-1",
            ),
        )
    with pytest.raises(InputError, match="a draft replaces nothing"):
        issue(
            db,
            CertificateRequest(
                "five-days",
                20,
                laboratory=LABORATORY,
                out=tmp_path,
                issued_on=DAY,
                draft=True,
                replaces="A-1",
                reason="x",
            ),
        )
    made = issue(
        db,
        CertificateRequest(
            "five-days",
            20,
            laboratory=LABORATORY,
            out=tmp_path,
            number="A-2",
            issued_on=DAY,
            replaces="A-1",
            reason="the customer's address was wrong",
        ),
    )
    record = from_document(CertificateRecord, load_certificate(db, "A-2").record)
    assert record.replaces == Replaced(
        "A-1", DAY, "the customer's address was wrong", load_certificate(db, "A-1").pdf_sha256
    )
    core = ET.fromstring(dcc_xml(record)).find(".//dcc:coreData", {"dcc": DCC})
    assert core is not None
    assert core.findtext("dcc:reportAmendedSubstituted/dcc:typeOfChange", None, {"dcc": DCC}) == "substituted"
    assert (
        core.findtext("dcc:reportAmendedSubstituted/dcc:replacedUniqueIdentifier", None, {"dcc": DCC})
        == "A-1"
    )
    assert (
        core.findtext("dcc:previousReport/dcc:value", None, {"dcc": DCC})
        == load_certificate(db, "A-1").pdf_sha256
    )
    page = " ".join(pypdf.PdfReader(made.file).pages[0].extract_text().split())
    assert "replaces certificate A-1 of 2026-03-12. Reason: the customer's address was wrong" in page
    old = load_certificate(db, "A-1")
    assert (old.state, old.replaced_by, old.reason) == ("amended", "A-2", "the customer's address was wrong")
    assert verify_file(db, VerificationRequest(tmp_path / "certificate-A-1.pdf")).ok is False
    assert verify_file(db, VerificationRequest(tmp_path / "certificate-A-2.pdf")).ok is True
    assert remake(db, RemakeRequest("A-2")).identical is True
    with pytest.raises(InputError, match="certificate A-1 is amended; only an issued one can be replaced"):
        issue(
            db,
            CertificateRequest(
                "five-days",
                20,
                laboratory=LABORATORY,
                out=tmp_path,
                number="A-3",
                issued_on=DAY,
                replaces="A-1",
                reason="x",
            ),
        )
    assert not (tmp_path / "certificate-A-3.pdf").exists()
    import_campaign(db, other_machine())
    with pytest.raises(
        InputError, match="campaign other is of machine M, certificate A-2 of HU40-T: it cannot"
    ):
        issue(
            db,
            CertificateRequest(
                "other", 20, laboratory=LABORATORY, out=tmp_path, issued_on=DAY, replaces="A-2", reason="x"
            ),
        )


def test_a_signature_is_judged_on_the_day_on_which_the_database_received_it(
    db: Database, key: FileKey, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = issue(
        db,
        CertificateRequest(
            "five-days", 20, laboratory=LABORATORY, out=tmp_path, number="S-4", issued_on=DAY, key=key
        ),
    )
    file = Path(made.file)
    asked: list[datetime | None] = []

    def noted(pdf: bytes, trusted: Path | None, at: datetime | None) -> SignatureFinding:
        asked.append(at)
        return check_signature(pdf, trusted, at)

    monkeypatch.setattr("monitor.workflow.certificate.verification.check_signature", noted)
    assert verify_file(db, VerificationRequest(file)).ok is True
    file.write_bytes(file.read_bytes() + b"x")
    assert verify_file(db, VerificationRequest(file)).ok is False
    # A file that is not the stored one was never seen here: it is judged as of now.
    assert asked == [load_certificate(db, "S-4").made_at.replace(tzinfo=UTC), None]


class Killed(BaseException):
    """What a process feels when it is stopped: nothing catches it on purpose."""


def killed(*_: object, **__: object) -> None:
    raise Killed("here")


def test_stopped_before_the_entry_no_file_bears_the_name_of_a_certificate(
    db: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pdf_unread
) -> None:
    before = set(list_certificates(db)["number"])
    monkeypatch.setattr(certificates, "save_certificate", killed)
    with pytest.raises(Killed, match="here"), pdf_unread():
        issue(
            db,
            CertificateRequest(
                "five-days", 20, laboratory=LABORATORY, out=tmp_path, number="K-1", issued_on=DAY
            ),
        )
    assert set(list_certificates(db)["number"]) == before
    assert list(tmp_path.iterdir()) == []


def test_stopped_behind_the_entry_the_database_gives_the_document_back(
    db: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pdf_unread
) -> None:
    monkeypatch.setattr(certificates, "publish", killed)
    with pytest.raises(Killed, match="here"), pdf_unread():
        issue(
            db,
            CertificateRequest(
                "five-days", 20, laboratory=LABORATORY, out=tmp_path, number="K-2", issued_on=DAY
            ),
        )
    assert list(tmp_path.glob("*.pdf")) == []
    made = write_issued(db, CertificateFileRequest("K-2", tmp_path))
    assert verify_file(db, VerificationRequest(Path(made.file))).ok is True
    assert Path(made.file).read_bytes() == load_certificate(db, "K-2").pdf


def test_stopped_behind_the_entry_the_next_certificate_gives_the_file_its_name(
    db: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pdf_unread
) -> None:
    """A kill of seed 13021 left the whole document under a name that nothing took away."""

    def issued(number: str) -> None:
        with pdf_unread():
            issue(
                db,
                CertificateRequest(
                    "five-days", 20, laboratory=LABORATORY, out=tmp_path, number=number, issued_on=DAY
                ),
            )

    with monkeypatch.context() as patch:
        patch.setattr(certificates, "publish", killed)
        with pytest.raises(Killed, match="here"):
            issued("K-5")
    # Of a process that is about to store it, and of somebody who planted it.
    (tmp_path / "certificate-K-6.pdf.part").write_bytes(b"not stored yet")
    (tmp_path / "certificate-K-7.pdf.part").symlink_to(tmp_path / "certificate-K-5.pdf.part")
    issued("K-8")
    assert (tmp_path / "certificate-K-5.pdf").read_bytes() == load_certificate(db, "K-5").pdf
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "certificate-K-5.pdf", "certificate-K-6.pdf.part", "certificate-K-7.pdf.part", "certificate-K-8.pdf",
    ]  # fmt: skip


def test_a_prepared_file_that_another_process_named_is_no_fault(tmp_path: Path) -> None:
    part = prepared(tmp_path / "c.pdf", b"content")
    part.rename(tmp_path / "c.pdf")
    publish(part, tmp_path / "c.pdf", "K-9")
    (tmp_path / "c.pdf").unlink()
    with pytest.raises(
        InputError, match=r"certificate K-9 is in the database, but its file cannot be written"
    ):
        publish(part, tmp_path / "c.pdf", "K-9")


def test_a_file_that_cannot_get_its_name_says_where_the_certificate_is(
    db: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pdf_unread
) -> None:
    def full(self: Path, target: Path) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with (
        pytest.raises(
            InputError, match=r"certificate K-3 is in the database, .*`monitor certificate show K-3 --pdf"
        ),
        pdf_unread(),
    ):
        issue(
            db,
            CertificateRequest(
                "five-days", 20, laboratory=LABORATORY, out=tmp_path, number="K-3", issued_on=DAY
            ),
        )
    assert load_certificate(db, "K-3").state == "issued"
