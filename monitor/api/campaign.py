"""One campaign of a database, and everything that can be asked about it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from monitor.api.arguments import argument, checked
from monitor.api.asking import Ask, answered, drawn
from monitor.api.tables import parameter_table, run_table, table_of
from monitor.exceptions import InputError

if TYPE_CHECKING:
    import pandas as pd

    from monitor.api.answers import (
        TypedCertificateFileAnswer,
        TypedChangeModelAnswer,
        TypedCompareAnswer,
        TypedExplainAnswer,
        TypedStatisticsAnswer,
        TypedUncertaintyAnswer,
        TypedVolumetricAnswer,
    )


class Campaign:
    """A campaign by its ``name``; made by ``Database.campaign``, which says what exists where there is none."""

    def __init__(self, ask: Ask, name: str, machine: str, method: str) -> None:
        self._ask = ask
        self.name = name
        self.machine = machine
        self.method = method

    @checked
    def runs(self) -> pd.DataFrame:
        """Return the runs (n runs, indexed by number) with their conditions: a column for each, in the unit that its
        name ends in (``ambient_degC`` in °C); times in UTC and by the shop's clock."""
        return run_table(self._ask("runs", campaign=self.name))

    @checked
    def readings(self) -> pd.DataFrame:
        """Return every reading (n rows, one a touch or reading): axes in mm and degrees; ``attrs["units"]`` has the
        units of the columns, ``attrs["meanings"]`` says what they are."""
        return table_of(self._ask("readings", campaign=self.name))

    @checked
    def parameters(self, model: str | None = None, *, wide: bool = True) -> pd.DataFrame:
        """Identify every run and return its parameters (n runs, 2 m): a column for each of the m parameters and its
        standard uncertainty in ``u(...)`` beside it, in the unit of ``attrs["units"]`` (µm, µrad, µm/m).

        ``wide=False``: (n m, 5), a row for every run and parameter, with run, parameter, value, u and unit. Raises
        NotFoundError for a model that does not exist.
        """
        is_wide = argument("wide", wide, bool)
        return parameter_table(self._ask("identify", campaign=self.name, model=model), wide=is_wide)

    @checked
    def statistics(self, **options: Any) -> TypedStatisticsAnswer:
        """Compare the runs: scatter by day and pooled, homogeneity, components of variance (``StatisticsRequest``).

        ``parameters`` has the numbers by parameter, each in its ``unit`` (µm, µrad, µm/m). The tests and their sources:
        docs/statistics.md. Raises InputError for a grouping that there is not.
        """
        return drawn(self._ask, "statistics", **self._of_this(options))

    @checked
    def compare(self, model: str | None = None) -> TypedCompareAnswer:
        """Compare the model with the measurements: where does it fail? Residuals in µm (of a curve in its own unit).

        ``verdict`` says whether the model explains them, ``lack_of_fit`` is the F test of lack of fit over the scatter
        of repeated readings, ``by`` the RMS by target, axis, run and indexation. Raises NotFoundError for a model that
        does not exist, DataError where the readings contradict the machine file.
        """
        return drawn(self._ask, "compare", campaign=self.name, model=model)

    @checked
    def explain(self, model: str | None = None, **options: Any) -> TypedExplainAnswer:
        """Search for the physical effects that the model lacks (``ExplainRequest``).

        ``missing`` has one record an effect: ``amplitude`` with standard uncertainty ``u`` in ``unit``, the largest
        displacement ``peak_um`` in µm, the RMS before and after in µm; cause and remedy stand in its ``description``.
        How it is searched: docs/effects.md. Raises NotFoundError for a model that does not exist, DataError where the
        readings contradict the machine file.
        """
        return drawn(self._ask, "explain", model=model, **self._of_this(options))

    @checked
    def add(
        self, effect: str | Sequence[str], name: str | None = None, *, to: str | None = None, note: str = ""
    ) -> TypedChangeModelAnswer:
        """Add an effect to the model ``to`` (by default the method's own), or several at once: of two that take each
        other's part neither shows what it is worth alone. The answer has the error before and after in ``history``, RMS
        in µm on the fitted and on held-out runs.

        ``name`` is that of the new model; without one the name ``to`` means the new version from now on. Raises
        EffectError for an effect that cannot be read, InputError where none is named.
        """
        first, *beside = argument("effect", effect, tuple[str, ...]) or ("",)
        if not first:
            raise InputError("name an effect to add, or several: campaign.add(['EXX:reversal', 'EXX:poly2'])")
        model = self.method if to is None else to
        return answered(
            self._ask(
                "add effect",
                effect=first,
                beside=tuple(beside),
                to=model,
                new_name=name,
                note=note,
                campaign=self.name,
            )
        )

    @checked
    def uncertainty(self, run: int | None = None, **options: Any) -> TypedUncertaintyAnswer:
        """Evaluate the uncertainty of one run, the last by default, after JCGM 102:2011 (``UncertaintyRequest``).

        ``guf`` (and ``mcm``) have estimate, u and expanded uncertainty by parameter in the display unit of ``units``
        (µm, µrad, µm/m); ``covariance`` is (m, m) in products of these units. Raises InputError, DataError.
        """
        return answered(self._ask("uncertainty", run=run, **self._of_this(options)))

    @checked
    def map(self, run: int | None = None, **options: Any) -> TypedVolumetricAnswer:
        """Evaluate the volumetric error over the strokes with its uncertainty (``VolumetricRequest``): vectors and
        lengths in µm at places in mm and degrees. Raises InputError for a machine that has no strokes to map."""
        return drawn(self._ask, "map", run=run, **self._of_this(options))

    @checked
    def certificate(
        self, laboratory: str | Path, run: int | None = None, *, out: str | Path = ".", **options: Any
    ) -> TypedCertificateFileAnswer:
        """Issue a calibration certificate after ISO/IEC 17025:2017, 7.8 as PDF into ``out`` (``CertificateRequest``).

        ``laboratory`` is the TOML file of what the laboratory states. The answer has ``number``, ``file`` and the
        ``sha256`` of the file. Raises InputError with all that is missing and each ground that speaks against it,
        DataError where the runs are too few for a joint region.
        """
        return answered(
            self._ask("issue certificate", run=run, laboratory=laboratory, out=out, **self._of_this(options))
        )

    def _of_this(self, options: dict[str, Any]) -> dict[str, Any]:
        """Return the options with the name of the campaign. Raises InputError where they name one."""
        if "campaign" in options:
            raise InputError(f"campaign is '{self.name}' here; db.campaign(NAME) is another")
        return {**options, "campaign": self.name}

    def __repr__(self) -> str:
        return f"Campaign('{self.name}') of {self.machine}, method {self.method}"

    def _repr_html_(self) -> str:
        """Return the name and the runs, as a notebook shows them."""
        from html import escape

        return f"<p>{escape(repr(self))}</p>{self.runs()._repr_html_()}"  # type: ignore[operator]
