"""Long-term health database for machine tools and coordinate measuring machines.

The rooms, from the lowest: ``machine``, ``readers``, ``statistics``, ``store`` and ``reporting`` import the ground
alone (``exceptions``, ``units``, ``records``, ``documents``, ``refusal``, ``sources``); above them stand
``effects``, ``methods``, ``uncertainty`` and ``discovery``, ``workflow``, and the faces ``cli`` and ``api``.

People in Python type ``import monitor as mm`` and find the names of ``monitor.api`` here.
"""

from __future__ import annotations

from typing import Any

__version__ = "0.2.0"
# Their types stand in __init__.pyi: this file imports nothing.
__all__ = ["Answer", "Campaign", "Database", "Machine", "Pictures", "open", "read", "simulate"]


def __getattr__(name: str) -> Any:
    """Load the Python interface when it is asked for: the command line waits for none of it."""
    if name in __all__:
        import importlib

        return getattr(importlib.import_module("monitor.api"), name)
    raise AttributeError(f"module 'monitor' has no attribute '{name}'; it has {', '.join(__all__)}")


def __dir__() -> list[str]:
    """Return the names that a notebook completes, those that are not loaded yet too."""
    return sorted({*globals(), *__all__})
