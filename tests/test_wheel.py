"""What the package carries: SQL, templates and types, found when installed and in a checkout alike.

``make wheel`` goes further and runs all tests against the installed wheel, away from the checkout.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib import metadata, resources
from pathlib import Path

import pytest

import monitor

CHECKOUT = Path(__file__).resolve().parents[1]
PACKAGE = Path(monitor.__file__).parent
DISTRIBUTION = "machine-health-monitor"

needs_checkout = pytest.mark.skipif(not (CHECKOUT / "monitor").is_dir(), reason="builds from the checkout")


def files_below(folder: Path) -> set[str]:
    """Relative names of the files that belong into a wheel."""
    return {
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    """The wheel, built from a copy, so that nothing is left in the checkout."""
    place = tmp_path_factory.mktemp("wheel")
    for name in ("monitor", "migrations", "reports"):
        shutil.copytree(CHECKOUT / name, place / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(CHECKOUT / name, place / name)
    command = [
        sys.executable,
        "-m",
        "pip",
        "-q",
        "wheel",
        "--no-deps",
        "--no-build-isolation",
        "-w",
        "dist",
        ".",
    ]
    built = subprocess.run(command, cwd=place, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    (path,) = (place / "dist").glob("machine_health_monitor-*.whl")
    return zipfile.ZipFile(path)


@pytest.mark.parametrize("name", ["monitor.migrations", "monitor.reports"])
def test_packed_folder_is_found_through_importlib_resources(name: str) -> None:
    assert resources.files(name).is_dir()


def test_migrations_are_numbered_without_a_gap() -> None:
    names = sorted(p.name for p in resources.files("monitor.migrations").iterdir() if p.name.endswith(".sql"))
    assert [int(name.split("_")[0]) for name in names] == list(range(1, len(names) + 1))
    assert names


def test_pep561_the_types_are_public() -> None:
    assert resources.files("monitor").joinpath("py.typed").is_file()


def test_distribution_has_the_version_of_the_package() -> None:
    assert metadata.version(DISTRIBUTION) == monitor.__version__


def test_distribution_has_the_command_monitor() -> None:
    commands = metadata.distribution(DISTRIBUTION).entry_points.select(group="console_scripts")
    assert [(command.name, command.module) for command in commands] == [("monitor", "monitor.cli")]


@needs_checkout
def test_every_folder_of_the_tree_is_a_package() -> None:
    folders = {path.parent for path in (CHECKOUT / "monitor").rglob("*.py")}
    assert sorted(str(folder) for folder in folders if not (folder / "__init__.py").exists()) == []


@needs_checkout
def test_wheel_holds_monitor_and_nothing_else(wheel: zipfile.ZipFile) -> None:
    tops = {name.split("/")[0] for name in wheel.namelist()}
    assert sorted(top for top in tops if not top.endswith(".dist-info")) == ["monitor"]


@needs_checkout
@pytest.mark.parametrize(
    ("folder", "inside"),
    [("monitor", "monitor"), ("migrations", "monitor/migrations"), ("reports", "monitor/reports")],
)
def test_wheel_holds_every_file_of(folder: str, inside: str, wheel: zipfile.ZipFile) -> None:
    packed = set(wheel.namelist())
    missing = sorted(name for name in files_below(CHECKOUT / folder) if f"{inside}/{name}" not in packed)
    assert missing == []


@needs_checkout
def test_constraints_pin_every_declared_dependency_and_name_no_host() -> None:
    text = (CHECKOUT / "constraints.txt").read_text(encoding="utf-8")
    pins = [line for line in text.splitlines() if line and not line.startswith("#")]
    pinned = {pin.split("==")[0].lower().replace("_", "-") for pin in pins}
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    declared = [
        *project["dependencies"],
        *(d for extra in project["optional-dependencies"].values() for d in extra),
    ]
    names = {d.split(";")[0].split(">")[0].split("=")[0].split("[")[0].strip().lower() for d in declared}
    assert sorted(names - pinned) == []
    assert all(pin.count("==") == 1 for pin in pins)
    assert "://" not in text


def test_wheel_alone_lands_in_site_packages() -> None:
    if (CHECKOUT / "monitor").is_dir():
        pytest.skip("the checkout is installed in place; make wheel runs this test on the wheel")
    installed = metadata.distribution(DISTRIBUTION).files or []
    tops = {path.parts[0] for path in installed if path.parts[0] != ".."}
    assert sorted(top for top in tops if not top.endswith(".dist-info")) == ["monitor"]
    assert PACKAGE.parent.name == "site-packages"
