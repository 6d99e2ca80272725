"""What a release consists of: the wheel, its bill of materials, the licences of what comes along, hashes of all pins.

Run by ``make supply``. Writes ``dist/`` (wheel, CycloneDX 1.6 JSON), ``docs/licences.md`` and
``tests/setup/hashes.txt``; ends with status 1 where a licence is none of ``ALLOWED``. Needs the extra ``release``.
"""

from __future__ import annotations

import csv
import io
import subprocess
import sys
import tempfile
from pathlib import Path

from environment import CHECKOUT, EXTRAS as INSTALLED, HASHES
from installed_wheel import build, say

#: What users may install; no tools for developers.
EXTRAS = "sign,token,web,completion,excel,qif,cluster,lake"
#: Licences that ask a user of the product for no more than a notice, or for the sources of that library alone (MPL).
ALLOWED = (
    "0BSD", "Apache", "BSD", "CC0-1.0", "DFSG approved", "HPND", "ISC", "MIT", "MPL", "Mozilla", "PSF",
    "Python Software Foundation", "Unlicense", "Zlib",
)  # fmt: skip
LICENCES = CHECKOUT / "docs" / "licences.md"
TOOLS = Path(sys.executable).parent

HEAD = """# Licences of what comes along

Made by `make supply` from the metadata of the packages that the wheel installs with all extras for users. It stops
where a licence is none of those that ask for no more than a notice, or for the sources of that library alone. Where
several are named with a semicolon the user may choose (pyphen: MPL). The versions stand in `constraints.txt`, and in
the bill of materials beside the wheel.

| package | licence |
| --- | --- |
"""


def main() -> int:
    """Write all, check the licences; the exit status is 1 where one is not allowed."""
    write_hashes()
    with tempfile.TemporaryDirectory(prefix="monitor-supply-") as folder:
        wheel = build(Path(folder))
        dist = CHECKOUT / "dist"
        dist.mkdir(exist_ok=True)
        (dist / wheel.name).write_bytes(wheel.read_bytes())
        venv = Path(folder) / "venv"
        output(sys.executable, "-m", "venv", "--without-pip", venv)
        python = venv / "bin" / "python"
        say("an environment with the wheel and what a user may install besides")
        output(
            sys.executable, "-m", "pip", "-q", "--python", python, "install", "-c", CHECKOUT / "constraints.txt",
            f"{wheel}[{EXTRAS}]",
        )  # fmt: skip
        bill = dist / f"{wheel.name.removesuffix('.whl')}.cdx.json"
        say(f"bill of materials: {bill.relative_to(CHECKOUT)}")
        output(
            TOOLS / "cyclonedx-py", "environment", "--pyproject", CHECKOUT / "pyproject.toml", "--spec-version", "1.6",
            "--output-reproducible", "--output-format", "JSON", "--output-file", bill, python,
        )  # fmt: skip
        table = output(
            TOOLS / "pip-licenses", "--python", python, "--from=mixed", "--format=csv", "--order=name",
            "--ignore-packages", "machine-health-monitor",
        )  # fmt: skip
    rows = [
        (row["Name"], row["License"]) for row in csv.DictReader(io.StringIO(table)) if row["Name"] != "pip"
    ]
    LICENCES.write_text(HEAD + "".join(f"| {name} | {licence} |\n" for name, licence in rows), "utf-8")
    refused = [f"{name}: {licence}" for name, licence in rows if not allowed(licence)]
    for line in refused:
        print(f"a licence that is not among the allowed ones: {line}", file=sys.stderr)
    return 1 if refused else 0


def allowed(licence: str) -> bool:
    """Whether one of the licences among which the user may choose is allowed."""
    return any(any(name in choice for name in ALLOWED) for choice in licence.split(";"))


def write_hashes() -> None:
    """Write the hashes of all files of what the set-up installs, in the pinned versions, for every platform."""
    say(f"hashes: {HASHES.relative_to(CHECKOUT)}")
    extras = [part for extra in INSTALLED.split(",") for part in ("--extra", extra)]
    output(
        TOOLS / "uv", "pip", "compile", "-q", CHECKOUT / "pyproject.toml", *extras, "-c", CHECKOUT / "constraints.txt",
        "--generate-hashes", "--universal", "--no-header", "--no-annotate", "--python-version", "3.11", "-o", HASHES,
    )  # fmt: skip


def output(*command: str | Path) -> str:
    """Standard output of a command. Raises CalledProcessError where it fails."""
    return subprocess.run(
        [str(part) for part in command], check=True, text=True, stdout=subprocess.PIPE
    ).stdout


if __name__ == "__main__":
    sys.exit(main())
