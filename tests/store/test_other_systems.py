"""Where the system is not POSIX: no ``fcntl``, none of the flags and calls that Windows lacks, files as it has them.

Shown in a process whose modules lack them and whose files behave as Microsoft documents it; Windows itself is not
tried here. Which module may need what only POSIX has is read from the syntax trees.
"""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import monitor

PACKAGE = Path(monitor.__file__).parent
EXAMPLES = Path(__file__).resolve().parents[2] / "examples"

#: Modules that Python's documentation calls "Availability: Unix", and those that other systems lack.
_MODULES = """
    crypt curses fcntl grp posix pty pwd readline resource spwd syslog termios tty _posixshmem _posixsubprocess"""
#: Names of ``os`` and ``signal`` with "Availability: Unix" or "not Windows", as far as anybody might use them here.
_NAMES = """
    O_CLOEXEC O_DIRECTORY O_DSYNC O_NOCTTY O_NOFOLLOW O_NONBLOCK O_SYNC SIGALRM SIGHUP SIGKILL SIGPIPE SIGQUIT SIGUSR1
    SIGUSR2 alarm chown chroot fchdir fchmod fchown fdatasync fork forkpty fpathconf fstatvfs getegid geteuid getgid
    getgroups getloadavg getpgid getpgrp getuid initgroups killpg lchown lockf major mkfifo mknod nice openpty pathconf
    pause pipe2 posix_fadvise posix_spawn pread preadv pthread_kill pthread_sigmask pwrite pwritev readv
    register_at_fork sched_getaffinity sched_setaffinity sched_yield sendfile setegid seteuid setgid setitimer setpgid
    setpriority setsid setuid siginterrupt sigpending sigtimedwait sigwait statvfs sync sysconf tcgetpgrp ttyname uname
    wait wait3 wait4 waitid writev"""
POSIX_MODULES, POSIX_NAMES = frozenset(_MODULES.split()), frozenset(_NAMES.split())

# A file that is open in this process is neither renamed over nor removed (CreateFile without FILE_SHARE_DELETE, as
# Python opens files); FlushFileBuffers needs a handle that may write; a folder has none; nine signs are in no name.
WITHOUT = """
import errno, os, stat, sys
posix_os = {name: getattr(os, name) for name in ("O_CREAT", "O_WRONLY", "O_RDWR")}

def is_open(path):
    try:
        status = os.stat(path)
        numbers = os.listdir("/proc/self/fd")
    except OSError:
        return False
    for number in numbers:
        try:
            other = os.stat("/proc/self/fd/" + number)
        except OSError:
            continue
        if (other.st_ino, other.st_dev) == (status.st_ino, status.st_dev) and stat.S_ISREG(other.st_mode):
            return True
    return False

def as_on_windows(event, arguments):
    if event in ("os.rename", "os.remove"):
        for path in arguments[: 2 if event == "os.rename" else 1]:
            # What is removed by the number of its folder is a temporary folder of Python's own.
            if not (event == "os.remove" and arguments[1] != -1) and is_open(path):
                raise PermissionError(errno.EACCES, "the process has it open", os.fspath(path))
        if event == "os.rename" and os.path.isdir(arguments[1]):
            raise PermissionError(errno.EACCES, "a folder is there", os.fspath(arguments[1]))
    elif event in ("open", "os.mkdir") and isinstance(arguments[0], (str, bytes)):
        path = os.fsdecode(arguments[0])
        makes = event == "os.mkdir" or (arguments[2] or 0) & posix_os["O_CREAT"]
        if makes and set(os.path.basename(path)) & set('<>:"|?*\\\\'):
            raise OSError(errno.EINVAL, "no name of a file", path)
        # Python lists folders with no such call.
        if event == "open" and arguments[1] is None and os.path.isdir(path):
            raise PermissionError(errno.EACCES, "a folder", path)

def fsync(descriptor):
    for line in open(f"/proc/self/fdinfo/{descriptor}"):
        if line.startswith("flags:") and not int(line.split()[1], 8) & 3:
            raise OSError(errno.EBADF, "open for reading alone")

os.fsync = fsync
for name in MISSING:
    vars(os).pop(name, None)
for name in LACKING:
    sys.modules[name] = None
import shutil, tempfile
# As Python has both there.
tempfile.TemporaryFile = tempfile.NamedTemporaryFile
shutil._use_fd_functions = False
if hasattr(shutil, "_rmtree_impl"):
    shutil._rmtree_impl = shutil._rmtree_unsafe  # from 3.14 on it is chosen when the module is loaded
sys.addaudithook(as_on_windows)
from monitor.cli import main
line, status = [], 0
for word in (*sys.argv[1:], "then"):
    if word != "then":
        line.append(word)
        continue
    status = status or main(line)
    line = []
sys.exit(status)
"""
#: What processes here need of the list: Python's own way to start one.
NEEDED_HERE = frozenset(
    {
        "register_at_fork",
        "_posixsubprocess",
        "posix",
        "_posixshmem",
        "wait",
        "fork",
        "sysconf",
        "uname",
    }
)


def typed(folder: Path, *words: str) -> str:
    names = (
        f"MISSING = {sorted(POSIX_NAMES - NEEDED_HERE)}\nLACKING = {sorted(POSIX_MODULES - NEEDED_HERE)}\n"
    )
    answer = subprocess.run(
        [sys.executable, "-c", names + WITHOUT, *words],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=250,
    )
    assert answer.returncode == 0, answer.stderr + answer.stdout
    return answer.stdout


VERBS = """watch in --once --rest 0 then campaigns then backup 1.duckdb then archive away --before 2099-01-01
    then compact then --db again.duckdb restore 1.duckdb then export tables"""


@pytest.mark.slow
def test_without_posix_campaigns_are_watched_and_read_and_files_are_copied(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "tables").mkdir()
    (tmp_path / "in" / "load-cell").symlink_to(EXAMPLES / "load-cell")
    said = typed(tmp_path, *VERBS.split())
    assert "load-cell: imported" in said
    assert (tmp_path / "again.duckdb").is_file()
    assert list((tmp_path / "away").rglob("data.csv"))
    assert (tmp_path / "tables" / "v_campaigns.csv").is_file()
    assert not list(tmp_path.rglob("*.lock")) + list(tmp_path.rglob("*.partial"))


SLOW_VERBS = """import five then uncertainty five-days --run 20 --method guf then
    certificate issue five-days --run 20 --laboratory five/laboratory.toml --number K:1 --out certificates then
    certificate issue five-days --run 19 --laboratory five/laboratory.toml --out one.pdf then
    report --week 2026-W10 --workers 2 --out report then standards laser --figures figures --csv figures.csv"""


@pytest.mark.slow
def test_without_posix_certificates_and_reports_are_written(tmp_path: Path) -> None:
    shutil.copytree(EXAMPLES / "five-days", tmp_path / "five")
    shutil.copy(EXAMPLES / "laboratory.toml", tmp_path / "five" / "laboratory.toml")
    shutil.copytree(EXAMPLES / "laser", tmp_path / "laser")
    typed(tmp_path, "import", "laser", "then", *SLOW_VERBS.split())
    assert [file.name for file in (tmp_path / "certificates").iterdir()] == ["certificate-K-1.pdf"]
    assert (tmp_path / "one.pdf").is_file()
    assert (tmp_path / "report" / "health-2026-W10.pdf").is_file()
    assert list((tmp_path / "figures").glob("*.svg"))
    assert not list(tmp_path.rglob("*.part"))


def posix_uses(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Line and name of every import and attribute that only POSIX systems have."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, name.name) for name in node.names if name.name in POSIX_MODULES)
        elif isinstance(node, ast.ImportFrom) and node.module in (*POSIX_MODULES, "os", "signal"):
            names = {name.name for name in node.names}
            if node.module in POSIX_MODULES or names & POSIX_NAMES:
                yield node.lineno, f"{node.module}.{', '.join(sorted(names))}"
        elif (
            isinstance(node, ast.Attribute)
            and isinstance(node.value, ast.Name)
            and node.value.id in ("os", "signal")
            and node.attr in POSIX_NAMES
        ):
            yield node.lineno, f"{node.value.id}.{node.attr}"


#: Where they stand, each behind a look whether the system has it: the folder of the package, then the file.
LOOKED_FOR = {
    "store/tickets.py": {"fcntl"},
    "store/turns.py": {"fcntl", "os.O_CLOEXEC", "os.O_NOFOLLOW", "os.O_NONBLOCK", "os.pread", "os.pwrite",
                       "os.geteuid", "os.fchmod"},
    "store/kept_blocks.py": {"fcntl", "os.O_NOFOLLOW", "os.O_NONBLOCK", "os.pread", "os.pwrite", "os.fchmod"},
    "store/unwritable.py": {"os.pread"},  # with a descriptor of kept_blocks, which has none elsewhere
    "store/copies/compaction.py": {"fcntl", "os.chown"},
    "web/note.py": {"fcntl", "os.geteuid"},
    "uncertainty/workers/processes.py": {"signal.pthread_sigmask"},
    "reporting/pdf/beside.py": {"os.fork", "os.sched_getaffinity", "signal.SIGKILL"},
    "workflow/health/report.py": {"os.sched_getaffinity"},
}  # fmt: skip


def test_what_only_posix_has_stands_in_the_files_that_look_for_it() -> None:
    # Without one of these words a file has neither such an import nor such an attribute, and is not parsed.
    spelt = re.compile(rf"\b(?:os|signal|{'|'.join(sorted(POSIX_MODULES))})\b")
    sources = {path: path.read_text("utf-8") for path in PACKAGE.rglob("*.py")}
    uses = {
        path.relative_to(PACKAGE).as_posix(): {name for _, name in posix_uses(ast.parse(source))}
        for path, source in sources.items()
        if spelt.search(source)
    }
    assert {file: names for file, names in uses.items() if names} == LOOKED_FOR


@pytest.mark.parametrize(
    "source",
    ["import pwd", "from fcntl import flock", "from os import fork, path", "import os\nos.killpg(1, 9)"],
)
def test_what_only_posix_has_is_seen(source: str) -> None:
    assert len(list(posix_uses(ast.parse(source)))) == 1
