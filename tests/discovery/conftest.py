"""Virtual campaigns and the labelled examples."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from by_path import load

from monitor.discovery import Explanation, explain
from monitor.methods.samba.method import problem_of
from monitor.readers import read_campaign
from monitor.records import Campaign

HERE = Path(__file__).resolve().parent
EXAMPLES = HERE.parents[1] / "examples"


@pytest.fixture(scope="session")
def virtual_campaigns() -> ModuleType:
    """The helper virtual.py beside this file."""
    found: ModuleType = load("virtual_campaigns", HERE / "virtual.py")
    return found


@pytest.fixture(scope="session")
def explained() -> Callable[[Campaign], Explanation]:
    """Explains a campaign with the plain model."""

    def run(campaign: Campaign) -> Explanation:
        return explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(1))

    return run


@pytest.fixture(scope="session")
def example(explained: Callable[[Campaign], Explanation]) -> Callable[[str], Explanation]:
    """Explains one of the labelled campaigns, once."""

    @cache
    def run(name: str) -> Explanation:
        return explained(read_campaign(EXAMPLES / name))

    return run
