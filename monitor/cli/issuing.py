"""What `certificate issue` and `amend` ask for alike: the laboratory, what is stated, the key that signs."""

from __future__ import annotations

import os
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from datetime import date
from pathlib import Path
from typing import Any

from monitor.bounded import LARGEST_SETTINGS, read_bounded
from monitor.cli.behind import add_behind, further_sources
from monitor.cli.configuration import configuration
from monitor.cli.parser import add_model
from monitor.cli.secret_files import warn_of_readers
from monitor.exceptions import InputError, did_you_mean
from monitor.moments import day_of
from monitor.reporting.certificate.dcc_elements import DccVersion
from monitor.reporting.certificate.grounds import GroundKind
from monitor.reporting.signature.signing import FileKey, Key, TokenKey
from monitor.workflow.certificate.request import METHODS, RULES

#: The environment variable with a token's PIN, unless --pin-from names another; an argument could be seen by others.
PIN = "MONITOR_TOKEN_PIN"


def add_issuing(parser: ArgumentParser) -> None:
    """The options of a certificate that is to be issued."""
    parser.add_argument(
        "--laboratory",
        type=Path,
        metavar="FILE",
        help="what the laboratory states (else that of the configuration)",
    )
    parser.add_argument(
        "--as-left", type=int, metavar="N",
        help="the run after an adjustment or repair: its results follow those as found, or stand alone without --run",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="PATH", help="a folder, or a file ending in .pdf")
    parser.add_argument("--number", metavar="NUMBER", help="default: the next of the year")
    parser.add_argument("--date", type=_day, metavar="YYYY-MM-DD", help="of issue; default: today")
    add_model(parser)
    parser.add_argument(
        "--linear-axes", type=Path, metavar="FILE",
        help="errors of the linear axes (TOML), for methods that take these axes as known",
    )  # fmt: skip
    add_behind(parser)
    parser.add_argument(
        "--method", choices=METHODS, default="guf",
        help="state the GUM framework's result, or the stored Monte Carlo result (default guf)",
    )  # fmt: skip
    parser.add_argument(
        "--conformity", choices=RULES, help="state conformity with the machine's tolerances by this rule"
    )
    parser.add_argument(
        "--process", action="append", default=[], metavar="PARAMETER=S",
        help="standard deviation, in its unit, with which the true values of machines of this kind scatter about zero: "
        "the statement then has the global risks of its rule (JCGM 106); repeat it",
    )  # fmt: skip
    parser.add_argument("--map", action="store_true", help="state the volumetric error too, with its figure")
    parser.add_argument(
        "--accept", action="append", type=_accepted, default=[], metavar="GROUND=REASON",
        help="issue it although this ground speaks against it, for a reason that is printed; may be repeated: "
        + ", ".join(kind.value for kind in GroundKind),
    )  # fmt: skip
    parser.add_argument(
        "--dcc-version", choices=[str(version) for version in DccVersion],
        help="release of the digital certificate (default: that of the laboratory's file, else the newest)",
    )  # fmt: skip
    add_fonts(parser)
    signing = parser.add_argument_group("signature (extra [sign]; for a token, extra [token])")
    signing.add_argument("--sign", type=Path, metavar="P12", help="sign with the key of a PKCS#12 file")
    signing.add_argument(
        "--passphrase-file", type=Path, metavar="FILE", help="its first line opens the PKCS#12 file"
    )
    signing.add_argument(
        "--token",
        type=Path,
        metavar="LIBRARY",
        help="sign with a key on a PKCS#11 token: its maker's library",
    )
    signing.add_argument(
        "--timestamp-url", metavar="URL",
        help="put a time stamp of this authority (RFC 3161) on the signature (else that of the configuration)",
    )  # fmt: skip
    signing.add_argument(
        "--long-term", type=Path, metavar="FILE",
        help="embed what proves later that the certificates of signer and time stamp were in force now (PAdES B-LT): "
        "FILE holds the certificates (PEM, DER) that both lead to (else that of the configuration)",
    )  # fmt: skip
    signing.add_argument("--token-label", metavar="LABEL", help="the label of the token")
    signing.add_argument("--token-slot", type=int, metavar="N", help="or its slot, counted from 0")
    signing.add_argument("--token-key", metavar="LABEL", help="the label of the key")
    signing.add_argument(
        "--token-certificate", metavar="LABEL", help="that of its certificate, if it has another label"
    )
    signing.add_argument(
        "--pin-from", metavar="VARIABLE", default=PIN,
        help=f"the environment variable with the PIN (default {PIN}; empty: the token has a PIN pad)",
    )  # fmt: skip


def add_fonts(parser: ArgumentParser) -> None:
    """The option for letters that our own fonts lack."""
    parser.add_argument(
        "--font", type=Path, action="append", default=[], metavar="FILE",
        help="a TrueType or OpenType font for letters that DejaVu Sans lacks, such as Chinese; may be repeated",
    )  # fmt: skip


def _day(text: str) -> date:
    try:
        return day_of(text, f"'{text}' is no day")
    except InputError as error:
        raise ArgumentTypeError(str(error)) from error


def _accepted(text: str) -> tuple[GroundKind, str]:
    name, _, reason = text.partition("=")
    try:
        return GroundKind(name.strip()), reason.strip()
    except ValueError as error:
        raise ArgumentTypeError(
            f"there is no ground '{name}'; {did_you_mean(name, [kind.value for kind in GroundKind])}there are "
            f"{', '.join(kind.value for kind in GroundKind)}; "
            "write --accept GROUND=REASON"
        ) from error


def issuing(options: Namespace) -> dict[str, Any]:
    """The options as the fields of ``CertificateOptions``. Raises InputError."""
    axes = None
    if options.linear_axes is not None:
        # Loaded here: hardly any certificate states errors of the linear axes.
        from monitor.readers import read_linear_axes

        axes = read_linear_axes(options.linear_axes)
    return {
        "laboratory": _laboratory(options.laboratory),
        "as_left": options.as_left,
        "out": options.out,
        "number": options.number,
        "issued_on": options.date,
        "model": options.model,
        "linear_axes": axes,
        "sources": further_sources(options.sources),
        "holds_for": options.holds_for,
        "method": options.method,
        "conformity": options.conformity,
        "process": _process(options.process),
        "with_map": options.map,
        "fonts": tuple(options.font),
        "key": _key(options),
        "accept": dict(options.accept),
        "dcc_version": options.dcc_version,
        "timestamp_url": _timestamp_url(options),
        "long_term": _long_term(options),
    }


def _laboratory(typed: Path | None) -> Path:
    stated = typed or configuration().laboratory
    if stated is None:
        raise InputError(
            "--laboratory FILE says what the laboratory states; `monitor certificate template` writes one to fill in"
        )
    return stated


def _process(texts: list[str]) -> dict[str, float]:
    process = {}
    for text in texts:
        name, _, number = text.partition("=")
        try:
            process[name] = float(number)
        except ValueError as error:
            raise InputError(
                f"--process {text}: write a parameter, = and a standard deviation, for example EA0B=5"
            ) from error
    return process


def _timestamp_url(options: Namespace) -> str | None:
    """The authority that was typed, else that of the configuration, which holds for what is signed."""
    if options.timestamp_url is None:
        return configuration().timestamp_url
    if options.sign is None and options.token is None:
        raise InputError(
            "a time stamp is put on a signature: --timestamp-url needs --sign or --token, which say by which key"
        )
    return str(options.timestamp_url)


def _long_term(options: Namespace) -> Path | None:
    """The file that was typed, else that of the configuration, which holds for what is signed with a time stamp."""
    if options.long_term is not None:
        return Path(options.long_term)
    signs = options.sign is not None or options.token is not None
    return configuration().long_term if signs and _timestamp_url(options) is not None else None


def _key(options: Namespace) -> Key | None:
    if options.sign is not None and options.token is not None:
        raise InputError("a certificate is signed once: choose --sign or --token")
    if options.sign is not None:
        return FileKey(options.sign, _passphrase(options.passphrase_file))
    if options.token is None:
        return None
    if options.token_key is None:
        raise InputError("--token-key LABEL says which key of the token signs")
    pin = os.environ.get(options.pin_from) if options.pin_from else None
    if options.pin_from and pin is None:
        raise InputError(
            f"the environment variable {options.pin_from} holds no PIN; set it, or give --pin-from '' where the token "
            "has a PIN pad"
        )
    return TokenKey(
        library=options.token,
        key=options.token_key,
        token=options.token_label,
        slot=options.token_slot,
        certificate=options.token_certificate,
        pin=pin,
    )


def _passphrase(file: Path | None) -> str | None:
    if file is None:
        return None
    try:
        warn_of_readers(file)
        return (read_bounded(file, LARGEST_SETTINGS).decode("utf-8").splitlines() or [""])[0]
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"the passphrase file {file} cannot be read: {error}") from error
