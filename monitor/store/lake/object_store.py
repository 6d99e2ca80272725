"""An object store that speaks S3 (AWS, MinIO, Ceph): where the Parquet files of a lake may lie instead of in a folder.

Who may enter stands in the environment, as the tools of such stores read it: ``AWS_ACCESS_KEY_ID`` and
``AWS_SECRET_ACCESS_KEY``, and where they are needed ``AWS_SESSION_TOKEN``, ``AWS_REGION`` (else ``AWS_DEFAULT_REGION``)
and ``AWS_ENDPOINT_URL_S3`` (else ``AWS_ENDPOINT_URL``), the address of a store of one's own.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from urllib.parse import urlsplit

import duckdb

from monitor.exceptions import InputError
from monitor.store.lake.extensions import literal, load

SCHEME = "s3://"


def address_of_files(files: str) -> str:
    """Return where files are said to lie: ``s3://BUCKET/FOLDER``, or the absolute path of a folder.

    Raises InputError for the address of something else, of which DuckDB would make a folder of that name, and where no
    folder can be made.
    """
    scheme = re.match(r"[A-Za-z][\w+.-]*://", files)
    if scheme is None:
        folder = Path(files).resolve()
        # Asked before a lake is made that would look for its files there ever after.
        # By way of `os.path`: pathlib raises for what lies in a folder that this user may not enter.
        nearest = next(path for path in (folder, *folder.parents) if os.path.exists(path))
        if not nearest.is_dir() or not os.access(nearest, os.W_OK | os.X_OK):
            raise InputError(f"--files {files}: nothing can be written to {nearest}")
        return str(folder)
    if scheme[0].lower() != SCHEME:
        raise InputError(
            f"{files}: the files of a lake lie in a folder, or at s3://BUCKET/FOLDER of an object store"
        )
    return SCHEME + files.removeprefix(scheme[0])


def enter(connection: duckdb.DuckDBPyConnection) -> None:
    """Let a connection read and write objects. Raises InputError without the extra, or where the keys are not said."""
    keys = {name: os.environ.get(name, "") for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY")}
    missing = [name for name, key in keys.items() if not key]
    if missing:
        raise InputError(
            f"the files of this lake lie in an object store; set {' and '.join(missing)} in the environment, and "
            "AWS_ENDPOINT_URL_S3 where it is a store of your own"
        )
    load(connection, "httpfs")
    options = {
        "KEY_ID": keys["AWS_ACCESS_KEY_ID"],
        "SECRET": keys["AWS_SECRET_ACCESS_KEY"],
        "SESSION_TOKEN": os.environ.get("AWS_SESSION_TOKEN", ""),
        "REGION": os.environ.get("AWS_REGION") or os.environ.get("AWS_DEFAULT_REGION") or "us-east-1",
        **_of_endpoint(os.environ.get("AWS_ENDPOINT_URL_S3") or os.environ.get("AWS_ENDPOINT_URL") or ""),
    }
    stated = ", ".join(f"{name} {literal(value)}" for name, value in options.items() if value)
    # In memory: it ends with the connection.
    connection.execute(f"CREATE OR REPLACE SECRET object_store (TYPE s3, {stated})")


def _of_endpoint(address: str) -> dict[str, str]:
    """Return the options of a store at an address; none for that of AWS. Raises InputError for what is no address."""
    if not address:
        return {}
    parts = urlsplit(address)
    if parts.scheme not in ("http", "https") or not parts.netloc or "@" in parts.netloc:
        raise InputError(
            "AWS_ENDPOINT_URL_S3 (or AWS_ENDPOINT_URL) has to be the address of a store without a name and a password, "
            "such as https://store.example.org:9000"
        )
    # Names of buckets are no hosts there.
    return {
        "ENDPOINT": parts.netloc + parts.path.rstrip("/"),
        "URL_STYLE": "path",
        "USE_SSL": "true" if parts.scheme == "https" else "false",
    }
