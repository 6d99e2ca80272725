"""Build the wheel, install it in an environment of its own, run the tests there, away from the checkout.

Shows what a checkout hides: a file that is not packed, a dependency that is not declared, a path that leads into the
source tree. Run by ``make wheel``; further arguments go to pytest.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

from environment import CHECKOUT, EXTRAS

# What a user installs on top of the wheel, by the names under which it is imported: the modules that need it are
# imported late, and may fail without it. Everything else has to be declared.
OF_EXTRAS = (
    "asn1crypto", "cryptography", "dask", "distributed", "fastapi", "h11", "lxml", "multipart", "openpyxl", "pkcs11",
    "plotly", "pydantic", "pyhanko", "pyhanko_certvalidator", "shtab", "starlette", "uvicorn",
)  # fmt: skip
IMPORT_ALL = f"""
import importlib, pkgutil, monitor
for module in pkgutil.walk_packages(monitor.__path__, "monitor.", onerror=lambda name: None):
    if module.name.endswith("__main__"):
        continue
    try:
        importlib.import_module(module.name)
    except ModuleNotFoundError as missing:
        if (missing.name or "").partition(".")[0] not in {OF_EXTRAS!r}:
            raise
"""

# What a build needs, and what the tests need besides the installed package.
SOURCES = ("pyproject.toml", "README.md", "LICENSE", "monitor", "migrations", "reports")
TEST_FILES = ("pyproject.toml", "README.md", "Makefile", "tests", "examples")


def main(pytest_arguments: list[str]) -> int:
    """Exit status of pytest, or of the first step before it that failed."""
    with tempfile.TemporaryDirectory(prefix="monitor-wheel-") as folder:
        place = Path(folder)
        try:
            wheel = build(place)
            python = install(wheel, place / "venv")
            outside = place / "outside"
            copy(TEST_FILES, outside)
            check_that_the_wheel_is_used(python, outside, place)
        except subprocess.CalledProcessError as failure:
            print(f"failed: {failure.cmd}", file=sys.stderr)
            return failure.returncode or 1
        say("the tests, against the installed wheel")
        return subprocess.run(
            [python, "-m", "pytest", *pytest_arguments], cwd=outside, env=environment()
        ).returncode


def build(place: Path) -> Path:
    """The wheel, from a clean copy: what an earlier build left in the checkout must not get into it."""
    say("build")
    source = place / "source"
    copy(SOURCES, source)
    run(
        sys.executable,
        "-m",
        "pip",
        "-q",
        "wheel",
        "--no-deps",
        "--no-build-isolation",
        "-w",
        place / "dist",
        source,
    )
    (wheel,) = (place / "dist").glob("*.whl")
    tops = {name.split("/")[0] for name in zipfile.ZipFile(wheel).namelist()}
    strangers = sorted(top for top in tops if top != "monitor" and not top.endswith(".dist-info"))
    if strangers:
        raise SystemExit(f"{wheel.name} would put {', '.join(strangers)} beside monitor in site-packages")
    return wheel


def install(wheel: Path, venv: Path) -> Path:
    """Python of a new environment that holds the wheel; first alone, to see that it declares what it imports."""
    say("install alone, ask the command for help, import every module")
    run(sys.executable, "-m", "venv", venv)
    python = venv / "bin" / "python"
    pip = (python, "-m", "pip", "--disable-pip-version-check", "-q")
    constraints = CHECKOUT / "constraints.txt"
    # Python compiles what the tests import; all 11 000 files would take half a minute.
    install = (*pip, "install", "--no-compile", "-c", constraints)
    run(*install, wheel)
    run(*pip, "check")
    run(venv / "bin" / "monitor", "--help", quiet=True)
    run(python, "-c", IMPORT_ALL)
    say(f"install with the extras {EXTRAS}")
    run(*install, f"{wheel}[{EXTRAS}]")
    return python


def check_that_the_wheel_is_used(python: Path, outside: Path, place: Path) -> None:
    """Stop when ``monitor`` would come from anywhere but the new environment."""
    where = subprocess.check_output(
        [python, "-c", "import monitor; print(monitor.__file__)"], cwd=outside, env=environment(), text=True
    ).strip()
    if not Path(where).resolve().is_relative_to((place / "venv").resolve()):
        raise SystemExit(f"the tests would use {where}, not the installed wheel")


def copy(names: tuple[str, ...], target: Path) -> None:
    """Copy these files and folders of the checkout to ``target``."""
    target.mkdir()
    for name in names:
        origin = CHECKOUT / name
        if origin.is_dir():
            shutil.copytree(origin, target / name, ignore=shutil.ignore_patterns("__pycache__"))
        elif origin.exists():
            shutil.copy2(origin, target / name)


def run(*command: str | Path, quiet: bool = False) -> None:
    """Run ``command``, not in the checkout; CalledProcessError when it fails."""
    output = subprocess.DEVNULL if quiet else None
    subprocess.run(
        [str(part) for part in command], check=True, env=environment(), stdout=output, cwd=os.path.sep
    )


def environment() -> dict[str, str]:
    """The environment without what could lead Python back to the checkout."""
    return {
        name: value
        for name, value in os.environ.items()
        if name not in {"PYTHONPATH", "VIRTUAL_ENV", "MONITOR_DB"}
    }


def say(step: str) -> None:
    """One line a step, so that a long wait has a name."""
    print(f"Wheel: {step}", flush=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
