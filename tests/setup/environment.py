"""Make the virtual environment: system libraries, ``.venv``, pinned packages, the project itself (editable).

Called by ``prepare.sh`` with a bare Python 3.11 or later; standard library only. Whatever is missing from the system is
installed where that is allowed (root, or sudo without a password); otherwise the script says what to type and ends with
exit status 3.
"""

from __future__ import annotations

import ctypes
import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[2]
VENV = CHECKOUT / ".venv"
PYTHON = VENV / "bin" / "python"
EXTRAS = "dev,sign,token,web,cluster,lake"
# Every file of every pinned version with its SHA-256; made by `make supply` from constraints.txt.
HASHES = CHECKOUT / "tests" / "setup" / "hashes.txt"

# What WeasyPrint opens at run time, and the Debian and Ubuntu package that holds it.
LIBRARIES = {
    "libgobject-2.0.so.0": "libglib2.0-0",
    "libpango-1.0.so.0": "libpango-1.0-0",
    "libpangoft2-1.0.so.0": "libpangoft2-1.0-0",
    "libharfbuzz.so.0": "libharfbuzz0b",
    "libfontconfig.so.1": "libfontconfig1",
}
# WeasyPrint still does without it, with a DeprecationWarning: installed along with the others, never asked for alone.
WELCOME = "libharfbuzz-subset0"

# Patience with a lock that another package manager holds, none with a network that is not there.
APT_SETTINGS = (
    "DPkg::Lock::Timeout=120",
    "Acquire::Retries=1",
    "Acquire::http::Timeout=30",
    "Acquire::https::Timeout=30",
)


class SetupStoppedError(Exception):
    """Something is missing that only the user can install; the message says what to type."""


def main() -> int:
    """Do the whole set-up; the exit status is 0, or 3 when the user has to do something first."""
    try:
        provide_system_packages()
        make_virtual_environment()
        install_packages()
    except SetupStoppedError as stop:
        print(f"\nSet-up stopped: {stop}", file=sys.stderr)
        return 3
    return 0


def provide_system_packages() -> None:
    """Install the libraries and the ``venv`` parts of Python that the system lacks."""
    packages = [package for library, package in LIBRARIES.items() if not can_open(library)]
    if packages:
        packages.append(WELCOME)
    if importlib.util.find_spec("ensurepip") is None:
        packages.append(f"python3.{sys.version_info.minor}-venv")
    if not packages:
        return
    command = f"apt-get install --no-install-recommends {' '.join(packages)}"
    if shutil.which("apt-get") is None:
        raise SetupStoppedError(
            f"the system lacks what Debian calls {', '.join(packages)}, and there is no apt-get here.\n"
            "Install the same libraries with the package manager of this system, then call make again."
        )
    as_root = root_prefix()
    if as_root is not None:
        say(f"system packages: {' '.join(packages)}")
        if apt_install(as_root, packages):
            return
    why = "may not install packages itself" if as_root is None else "could not install them"
    raise SetupStoppedError(
        f"system packages are missing, and this script {why}. Type\n\n"
        f"    sudo apt-get update\n    sudo {command}\n\nthen call make again."
    )


def can_open(library: str) -> bool:
    """Whether the dynamic loader finds ``library``, which is how WeasyPrint will look for it."""
    if sys.platform != "linux":
        return True
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def root_prefix() -> list[str] | None:
    """What to put before a command to run it as root without a question; None where that is not possible."""
    if os.geteuid() == 0:
        return []
    if shutil.which("sudo") and subprocess.run(["sudo", "-n", "true"], capture_output=True).returncode == 0:
        return ["sudo", "-n"]
    return None


def apt_install(as_root: list[str], packages: list[str]) -> bool:
    """Install ``packages``; a fresh machine has no package lists yet, so a second try comes after fetching them."""
    settings = [part for setting in APT_SETTINGS for part in ("-o", setting)]
    apt = [*as_root, "env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-qq", *settings]
    install = [*apt, "install", "-y", "--no-install-recommends", *packages]
    if subprocess.run(install, capture_output=True).returncode == 0:
        return True
    return subprocess.run([*apt, "update"]).returncode == 0 and subprocess.run(install).returncode == 0


def make_virtual_environment() -> None:
    """Make ``.venv``, or keep the one that is there if its Python runs and is new enough."""
    usable = "import sys, pip; sys.exit(sys.version_info < (3, 11))"
    if PYTHON.exists() and subprocess.run([PYTHON, "-I", "-c", usable], capture_output=True).returncode == 0:
        return
    say(f"virtual environment .venv with Python {sys.version.split()[0]}")
    if not succeeds(sys.executable, "-m", "venv", "--clear", VENV):
        raise SetupStoppedError(
            f"{sys.executable} could not make the virtual environment {VENV}; its words are above."
        )


def install_packages() -> None:
    """Install what is pinned, each file compared with its hash, then the project; nothing else may be missing."""
    say("packages, as pinned in constraints.txt (a minute or two, the first time)")
    pip = (PYTHON, "-m", "pip", "--disable-pip-version-check", "-q")
    offline = ("--no-index", "--no-build-isolation", "--editable", f"{CHECKOUT}[{EXTRAS}]")
    if not (
        succeeds(*pip, "install", "--require-hashes", "--no-deps", "-r", HASHES)
        and succeeds(*pip, "install", *offline)
    ):
        raise SetupStoppedError(
            "pip could not install the packages; its words are above. Calling make again goes on."
        )


def succeeds(*command: str | Path) -> bool:
    """Run ``command``; whether it ended with exit status 0. What it says is shown only if it did not."""
    done = subprocess.run(
        [str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    if done.returncode != 0:
        print(done.stdout, file=sys.stderr)
    return done.returncode == 0


def say(step: str) -> None:
    """One line a step, so that a long wait has a name."""
    print(f"Set-up: {step}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
