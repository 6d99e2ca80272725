"""The questions about calibration certificates: issue, amend, withdraw, show, write, make again, verify."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from datetime import date
from pathlib import Path

from monitor.exceptions import InputError
from monitor.records import LinearAxes
from monitor.reporting.certificate.dcc_elements import dcc_version
from monitor.reporting.certificate.grounds import GroundKind
from monitor.reporting.signature.signing import Key
from monitor.sources import Source
from monitor.workflow.uncertainty.request import Asked, holds_for

METHODS = ("guf", "mcm")
#: Decision rules of a statement of conformity. Each has its words and its risk among the texts: conformity.rule_simple,
#: conformity.risk_simple, ...
RULES = ("simple", "guard", "iso14253", "ilac", "probability")


@dataclass(frozen=True, kw_only=True)
class CertificateOptions:
    """What a certificate states besides the results, where it goes, and how it is closed.

    ``laboratory`` is the file of what the laboratory states. ``as_left`` is the run that was measured after an
    adjustment or repair: its results stand beside those as found (ISO/IEC 17025:2017, 7.8.4.1 d), or alone. ``out`` is
    a folder or a file. ``number`` is the next free one of the year and ``issued_on`` today where None. ``linear_axes``
    are those of `monitor uncertainty`, for a method that takes these axes as known, and so are ``sources`` and
    ``holds_for``. ``method``: guf, or mcm for the
    stored Monte Carlo result. ``conformity`` names a decision rule; its statement replaces the laboratory's word on
    conformity. ``process`` are standard deviations by parameter, in its unit, with which the true values of machines
    of this kind scatter about zero: the statement then has the global risks of its rule. ``with_map`` adds the
    volumetric error. ``fonts`` are files with letters that DejaVu Sans lacks. ``key`` signs it. ``accept`` names the
    grounds against the certificate that the laboratory answers for, each with the reason that is printed on it.
    ``dcc_version`` is the release of the digital certificate (else that of the laboratory's file, else the newest).
    ``timestamp_url`` is the address of an authority that puts a time stamp (RFC 3161) on the signature;
    ``long_term`` is a file of the certificates that both lead to: what is needed to judge them later is embedded.

    Raises InputError for a method or a rule that there is not, or a blank reason.
    """

    laboratory: Path
    as_left: int | None = None
    out: Path | None = None
    number: str | None = None
    issued_on: date | None = None
    model: str | None = None
    linear_axes: LinearAxes | None = None
    sources: tuple[Source, ...] | None = None
    holds_for: str | None = None
    method: str = "guf"
    draft: bool = False
    conformity: str | None = None
    process: Mapping[str, float] = field(default_factory=dict)
    with_map: bool = False
    fonts: tuple[Path, ...] = ()
    key: Key | None = None
    accept: Mapping[GroundKind, str] = field(default_factory=dict)
    dcc_version: str | None = None
    timestamp_url: str | None = None
    long_term: Path | None = None

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise InputError(f"--method {self.method}: a certificate states guf or mcm")
        if self.conformity not in (None, *RULES):
            raise InputError(f"there is no decision rule '{self.conformity}'; there are {', '.join(RULES)}")
        if self.process and self.conformity is None:
            raise InputError("--process belongs to a statement of conformity: name its rule by --conformity")
        for name, spread in self.process.items():
            if not 0.0 < spread < math.inf:
                raise InputError(f"--process {name}={spread:g}: a standard deviation is positive")
        holds_for(self.holds_for)
        if self.timestamp_url is not None and not re.match(r"https?://[^/]", self.timestamp_url):
            raise InputError(
                f"--timestamp-url {self.timestamp_url}: write the address of the authority, with http:// or https://"
            )
        if self.long_term is not None and (self.key is None or self.timestamp_url is None):
            raise InputError(
                "--long-term belongs to a signature with a time stamp: name the key by --sign or --token, and the "
                "authority by --timestamp-url"
            )
        if self.dcc_version is not None:
            dcc_version(self.dcc_version)
        for kind, reason in self.accept.items():
            if not reason.strip():
                raise InputError(f"--accept {kind}=REASON: say why the laboratory accepts it; it is printed")

    @property
    def asked(self) -> Asked:
        """What decides the numbers of the evaluation besides run and model."""
        return Asked(linear_axes=self.linear_axes, holds_for=holds_for(self.holds_for), sources=self.sources)


@dataclass(frozen=True)
class CertificateRequest(CertificateOptions):
    """A certificate for one ``run`` of a ``campaign``.

    ``run`` may be None where the campaign has one run only, or where ``as_left`` names the only one that is certified.
    ``replaces`` is the number of the certificate that this one amends, for a ``reason``: it says so on paper (ISO/IEC
    17025:2017, 7.8.8.3), and the old one is marked with it.
    """

    campaign: str
    run: int | None = None
    replaces: str | None = None
    reason: str = ""


@dataclass(frozen=True)
class AmendmentRequest(CertificateOptions):
    """A new certificate that replaces another, of the same campaign and runs unless others are named."""

    replaces: str
    reason: str
    campaign: str | None = None
    run: int | None = None

    def certificate(self, campaign: str, run: int | None, as_left: int | None) -> CertificateRequest:
        """The question for the new certificate, of the runs of the old one."""
        options = {field.name: getattr(self, field.name) for field in fields(CertificateOptions)}
        return CertificateRequest(
            campaign, run, self.replaces, self.reason, **(options | {"as_left": as_left})
        )


@dataclass(frozen=True)
class WithdrawalRequest:
    """A certificate to be marked as withdrawn, and why."""

    number: str
    reason: str


@dataclass(frozen=True)
class CertificateShowRequest:
    """The certificate of a ``number``."""

    number: str


@dataclass(frozen=True)
class CertificatesRequest:
    """All certificates."""


@dataclass(frozen=True)
class CertificateFileRequest:
    """A file of the certificate of a ``number``, to be written to ``path``, a folder or a file."""

    number: str
    path: Path


@dataclass(frozen=True)
class RemakeRequest:
    """A certificate to be made again from its stored record; written to ``path``, a folder or a file, where named.

    ``fonts`` are those that it was made with besides ours.
    """

    number: str
    path: Path | None = None
    fonts: tuple[Path, ...] = ()


@dataclass(frozen=True)
class VerificationRequest:
    """A ``file`` that may be a certificate of this database; ``trusted`` is a file of trusted signers
    (certificates in PEM or DER, or fingerprints), ``expected`` the hash of the file as it was noted elsewhere
    when it was issued.

    Raises InputError for what is no hash.
    """

    file: Path
    trusted: Path | None = None
    expected: str | None = None

    def __post_init__(self) -> None:
        if self.expected is not None and not re.fullmatch(r"\s*[0-9a-fA-F]{64}\s*", self.expected):
            raise InputError(f"--expect {self.expected}: the SHA-256 of a file has 64 hexadecimal digits")
