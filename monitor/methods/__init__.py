"""Calibration methods, one file each, and the least-squares solver that they share.

A method is a module with ``NAME``, ``problem_of(campaign, model)``, ``identify(campaign, model, solve)``, where
``solve`` gives the problem's solution, and ``advice``, what to do about parameters that a plan cannot separate; another
one is another file, listed here.
"""

from __future__ import annotations

from types import ModuleType

from monitor.exceptions import DataError
from monitor.methods.free_form import method as free_form
from monitor.methods.l_shape import method as l_shape
from monitor.methods.rotary_probing import method as rotary_probing
from monitor.methods.samba import method as samba
from monitor.methods.tracker import method as tracker

METHODS: dict[str, ModuleType] = {
    module.NAME: module for module in (samba, rotary_probing, free_form, tracker, l_shape)
}


def method_named(name: str) -> ModuleType:
    """The method of a campaign; DataError lists those that can be identified."""
    if name not in METHODS:
        raise DataError(f"method '{name}' cannot be identified yet; these can: {', '.join(METHODS)}")
    return METHODS[name]
