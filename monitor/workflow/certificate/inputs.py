"""What a certificate was computed from and made with: stored beside its record and inside its PDF."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from monitor.documents import INLINED, OMITTED
from monitor.records import LinearAxes
from monitor.sources import Source
from monitor.workflow.certificate.files import HashedFile


@dataclass(frozen=True)
class RunInputs:
    """What belongs to one certified run.

    ``seed`` is that of the Monte Carlo that the framework was compared with: the framework draws no random numbers.
    ``stored_result`` and ``stored_monte_carlo`` are numbers in v_analyses; None for an evaluation that was made for the
    certificate, and where no Monte Carlo result was stored.
    """

    run: int
    seed: int | None
    stored_result: int | None
    stored_monte_carlo: int | None


@dataclass(frozen=True)
class CertificateInputs:
    """What the results of a certificate were computed from; ``states`` are those of the machine, one a run."""

    campaign: str
    run: RunInputs = field(metadata=INLINED)
    files: tuple[HashedFile, ...]
    model: str
    model_effects: tuple[str, ...]
    software: str
    page_made_by: Mapping[str, str]
    fonts: tuple[HashedFile, ...]
    states: tuple[str, ...]
    as_left: RunInputs | None = field(default=None, metadata=OMITTED)
    linear_axes_mm: LinearAxes | None = field(default=None, metadata=OMITTED)
    sources: tuple[Source, ...] | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class MadeWith:
    """The part of stored inputs that is read again; earlier records lack some of it."""

    page_made_by: Mapping[str, str] = field(default_factory=dict)
    fonts: tuple[HashedFile, ...] = ()
    states: tuple[str, ...] = ()
