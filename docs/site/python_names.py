"""The reference of the Python interface: autodoc reads the docstrings of the names that ``import monitor`` has."""

# ruff: noqa: E501 -- prose of pages
from __future__ import annotations

import inspect

import monitor

HEAD = """# Python interface

`import monitor as mm`: these names, made from their docstrings. A first look with examples: [in Python](../python.md). What a request takes and
what an answer holds: [questions and documents](documents.md). `TypedCompareAnswer` and its like are what type checkers and editors see: an `Answer` with the fields of `CompareAnswer`
as attributes, and of the records that stand in italics there.

"""

#: Classes that a user makes; objects of all others come from functions and methods, and their constructors are no
#: part of the interface.
MADE = {"Machine"}
HIDDEN = "   :exclude-members: __init__\n"


def page() -> str:
    """Return the page."""
    directives = []
    for name in sorted(monitor.__all__, key=str.lower):
        if inspect.isclass(getattr(monitor, name)):
            directives.append(
                f".. autoclass:: monitor.api.{name}\n   :members:\n{HIDDEN * (name not in MADE)}"
            )
        else:
            directives.append(f".. autofunction:: monitor.api.{name}\n")
    return HEAD + "```{eval-rst}\n" + "\n".join(directives) + "```\n"
