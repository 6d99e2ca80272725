"""Modules of numpy that nothing here asks for: loaded when somebody does, not where scipy names them.

What they do is not changed: they stand where an import would put them, and load themselves at the first question (the
recipe of importlib's documentation). Only a process that answers one question does so.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from importlib.util import LazyLoader, find_spec, module_from_spec
from types import ModuleType

#: ``scipy.special`` names every module of numpy once (it copies the package), and so loads these. Their regular
#: expressions and the libraries of tests take 0.05 of its 0.14 s (numpy 2.4, scipy 1.17).
_UNNEEDED = ("f2py", "testing")


class _Lookout:
    """Defers the modules when ``scipy.special`` is looked for: numpy is loaded then, and nobody has named them yet."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find nothing: the others on ``sys.meta_path`` load the module."""
        if name == "scipy.special":
            sys.meta_path.remove(self)
            _defer_unneeded()
        return None


def defer_unneeded() -> None:
    """Let modules of numpy that nothing here needs load themselves when one of their names is asked for.

    Nothing is loaded here: a verb that needs no numpy has none. For a process that answers one question; where
    ``scipy.special`` is loaded already, nothing is changed.
    """
    if "scipy.special" not in sys.modules:
        sys.meta_path.insert(0, _Lookout())


def _defer_unneeded() -> None:
    numpy = sys.modules["numpy"]
    for name in _UNNEEDED:
        whole = f"numpy.{name}"
        spec = None if whole in sys.modules else find_spec(whole)
        if spec is None or spec.loader is None:
            continue
        spec.loader = LazyLoader(spec.loader)
        module = module_from_spec(spec)
        sys.modules[whole] = module
        spec.loader.exec_module(module)
        # As the import of a module does; asked for by its name, numpy would load it at once.
        setattr(numpy, name, module)
