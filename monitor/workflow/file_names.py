"""Names of files made from names that people chose: of certificates, setups, machines."""

from __future__ import annotations

import re

# Signs that Windows has in no name (Microsoft, "Naming Files, Paths, and Namespaces"); / is a folder everywhere.
_IN_NO_NAME = re.compile(r'[<>:"/\\|?*\x00-\x1f]')


def file_name(text: str) -> str:
    """Return the text with a hyphen for each sign that stands in no file name of some system."""
    return _IN_NO_NAME.sub("-", text)
