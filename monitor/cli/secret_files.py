"""Files that hold a secret: a passphrase, a token, a password. Whoever lets others read one is told so."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def warn_of_readers(file: Path) -> None:
    """Say where others than its owner may read a secret. Raises OSError for a file that is not there."""
    if os.stat(file).st_mode & 0o077:
        print(
            f"monitor: {file} holds a secret and may be read by others than its owner; `chmod 600` keeps them out",
            file=sys.stderr,
        )
