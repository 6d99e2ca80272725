"""The reference of the configuration, from the file that ``monitor config init`` writes."""

# ruff: noqa: E501 -- prose of pages

from __future__ import annotations

import inspect
from dataclasses import fields

from markdown import code, of_docstring

from monitor.cli import configuration

HEAD = """# Configuration

One file with what would be typed again and again. `monitor config init` writes it, `monitor config check` names every fault, `monitor config show` prints what holds and
where it comes from. More words: [the command line](../command-line.md#configuration).

"""


def page() -> str:
    """Return the page."""
    keys = ", ".join(
        code(field.name) for field in fields(configuration.Configuration) if field.name != "file"
    )
    where = of_docstring((inspect.getdoc(configuration) or "").partition("\n\n")[2])
    return f"{HEAD}{where}\n\nKeys: {keys}. The file as it is written says what each is:\n\n```toml\n{configuration.TEMPLATE}```\n"
