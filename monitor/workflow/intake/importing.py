"""Campaign folders into the database, all or nothing each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from monitor.documents import OMITTED
from monitor.exceptions import CampaignError, InputError, StoreError
from monitor.readers import (
    MAPPING,
    UnderstoodFile,
    doubts,
    files_in,
    is_export_folder,
    names_in,
    read_campaign,
    read_exports,
    understood_tables,
)
from monitor.records import Campaign, CurveCampaign
from monitor.reporting import messages
from monitor.stopping import Stop, StoppedError, stoppable
from monitor.store import (
    Database,
    Imported,
    campaign_notes,
    clear_refusals,
    import_campaign,
    import_curve,
    record_refusal,
)
from monitor.workflow.intake.checked_tolerances import check_tolerances
from monitor.workflow.intake.copied_runs import check_copies
from monitor.workflow.intake.curve_base import check_base
from monitor.workflow.intake.gross_doubts import gross_doubts
from monitor.workflow.tool_frames import tool_frames
from monitor.workflow.true_values import is_truth


@dataclass(frozen=True)
class ImportRequest:
    """The folders to be imported, in this order.

    With a ``mapping`` the ``folders`` are files of instruments (or folders of them) that make one campaign, which may
    be called ``campaign`` instead of what the mapping calls it. A ``dry_run`` says what was understood and stores
    nothing.
    """

    folders: Sequence[Path]
    mapping: Path | None = None
    campaign: str | None = None
    dry_run: bool = False

    def __post_init__(self) -> None:
        if self.campaign is not None and self.mapping is None:
            raise InputError(
                "campaign names what files of instruments make together; give their mapping too, or write "
                'campaign = "NAME" in the mapping.toml of a folder'
            )


@dataclass(frozen=True)
class ImportedFolder:
    """What the import of a folder did: "imported", "unchanged" where its content was in the database already, or
    "not stored" in a dry run.

    ``rows`` is the number of rows of a curve, None for the campaign of a machine; ``notes`` say what may be a mistake;
    ``understood`` says of each file of an instrument (of a dry run of each table) what its columns were taken for.
    """

    campaign: str
    folder: str
    state: str
    runs: int
    probings: int
    rows: int | None
    notes: tuple[str, ...]
    message: str
    understood: tuple[UnderstoodFile, ...] = ()


@dataclass(frozen=True)
class RefusedFolder:
    """A folder of which nothing was kept, and why: all its faults in one text."""

    folder: str
    why: str


@dataclass(frozen=True)
class ImportAnswer:
    """The imported folders in their order, those that were refused, and the files of true values among them, which
    belong to a rehearsal and were ``passed_over``."""

    imported: tuple[ImportedFolder, ...]
    refused: tuple[RefusedFolder, ...] = ()
    passed_over: tuple[str, ...] | None = field(default=None, metadata=OMITTED)


class StoppedImportError(StoppedError):
    """An import that was taken back between or within its folders.

    ``answer`` says what became of the folders before, which are in the database; of those ``not_imported`` nothing is.
    """

    def __init__(self, answer: ImportAnswer, not_imported: Sequence[str]) -> None:
        super().__init__("taken back")
        self.answer = answer
        self.not_imported = tuple(not_imported)


@dataclass(frozen=True)
class _Source:
    """What is imported at once: a folder, or the files of instruments that a mapping explains."""

    path: Path
    mapping: Path | None = None
    files: tuple[Path, ...] = ()
    name: str | None = None


@dataclass(frozen=True)
class _Reading:
    """A campaign as it was read, what was noticed, and what was understood of the files of instruments."""

    campaign: Campaign | CurveCampaign
    notes: tuple[str, ...]
    understood: tuple[UnderstoodFile, ...]


def import_folders(
    db: Database, request: ImportRequest, *, progress: Callable[[str], None] = lambda name: None
) -> ImportAnswer:
    """Import every folder, all or nothing each; one that is refused does not hinder the others.

    The file of true values that a rehearsal wrote is passed over where it is named beside folders. Every refusal is
    recorded, but of a dry run. Raises CampaignError with all faults of a folder that was asked for alone, StoreError
    where the database cannot be written, StoppedImportError where the import is taken back.
    """
    answers: list[ImportedFolder] = []
    refused: list[RefusedFolder] = []
    sources, passed_over = _sources(request)
    for number, source in enumerate(sources):
        progress(str(source.path))
        try:
            answers.append(_look(db, source) if request.dry_run else _import(db, source))
        except StoppedError as error:
            so_far = ImportAnswer(tuple(answers), tuple(refused), passed_over or None)
            raise StoppedImportError(so_far, [str(rest.path) for rest in sources[number:]]) from error
        except StoreError as error:
            if not answers:
                raise
            before = ", ".join(answer.campaign for answer in answers)
            raise StoreError(f"{error}\nIn the database before it was met: {before}") from error
        except InputError as error:
            if len(sources) == 1:
                raise
            refused.append(RefusedFolder(str(source.path), str(error)))
    return ImportAnswer(tuple(answers), tuple(refused), passed_over or None)


def _sources(request: ImportRequest) -> tuple[list[_Source], tuple[str, ...]]:
    """Return what is imported, and what is passed over; a name that stands alone was meant."""
    if request.mapping is None:
        named = [Path(folder) for folder in request.folders]
        passed_over = [path for path in named if len(named) > 1 and is_truth(path)]
        return [_Source(path) for path in named if path not in passed_over], tuple(map(str, passed_over))
    files: list[Path] = []
    for folder in map(Path, request.folders):
        files += files_in(folder) if folder.is_dir() else [folder]
    return [_Source(request.mapping, request.mapping, tuple(files), request.campaign)], ()


def _read(db: Database, source: _Source) -> _Reading:
    """Read a folder and look for what may be a mistake. Raises CampaignError with all its faults."""
    understood: tuple[UnderstoodFile, ...] = ()
    notes: tuple[str, ...] = ()
    campaign: Campaign | CurveCampaign
    if source.mapping is not None or is_export_folder(source.path):
        mapping = source.mapping or source.path / MAPPING
        exports = read_exports(mapping, source.files or files_in(source.path), source.name)
        campaign, understood, notes = exports.campaign, exports.files, exports.notes
    else:
        campaign = read_campaign(source.path)
    if isinstance(campaign, CurveCampaign):
        check_base(campaign)
        return _Reading(campaign, (), ())
    if campaign.sources:
        # Loaded here: hardly any campaign states sources, and the solver takes a third of a second.
        from monitor.workflow.intake.checked_sources import check_sources

        check_sources(campaign)
    check_tolerances(campaign)
    notes = (
        *notes,
        *check_copies(db, campaign),
        *doubts(campaign, tool_frames(campaign)),
        *gross_doubts(campaign),
    )
    return _Reading(campaign, notes, understood)


def _look(db: Database, source: _Source) -> ImportedFolder:
    """Say what was understood of a folder, and store nothing."""
    reading = _read(db, source)
    campaign = reading.campaign
    if isinstance(campaign, CurveCampaign):
        rows = len(campaign.lines)
        message = messages.only_understood(campaign.name, rows)
        return ImportedFolder(campaign.name, str(source.path), "not stored", 0, 0, rows, (), message)
    runs, probings = len(campaign.runs), len(campaign.probings)
    return ImportedFolder(
        campaign.name, str(source.path), "not stored", runs, probings, None, reading.notes,
        messages.only_understood(campaign.name, probings, runs),
        reading.understood or understood_tables(campaign),
    )  # fmt: skip


def _import(db: Database, source: _Source) -> ImportedFolder:
    """Import one folder, which settles earlier refusals of it or of its campaign, or record that it was refused."""
    path = _resolved(source.path)
    try:
        reading = _read(db, source)
        campaign = reading.campaign
        if isinstance(campaign, CurveCampaign):
            imported = import_curve(db, campaign)
        else:
            imported = import_campaign(db, campaign, reading.notes)
    except StoreError:
        # Nothing is wrong with the folder; and where the database cannot be written nothing can be recorded.
        raise
    except InputError as error:
        faults = [str(fault) for fault in error.faults] if isinstance(error, CampaignError) else [str(error)]
        name, machine = names_in(source.path)
        with suppress(StoreError):  # the faults of the folder are what the user has to hear
            record_refusal(db, path, faults, campaign=source.name or name, machine=machine)
        raise
    # It is in the database: who takes the import back now hears so.
    with stoppable(Stop()):
        clear_refusals(db, path, imported.campaign)
        return _answer(db, source.path, imported, reading.understood)


def _answer(
    db: Database, folder: Path, imported: Imported, understood: tuple[UnderstoodFile, ...]
) -> ImportedFolder:
    # Of a campaign that was imported before, its notes are not repeated.
    notes = campaign_notes(db, imported.campaign) if imported.state == "imported" else ()
    return ImportedFolder(
        campaign=imported.campaign,
        folder=str(folder),
        state=imported.state,
        runs=imported.runs,
        probings=imported.probings,
        rows=imported.rows,
        notes=notes,
        message=str(imported),
        understood=understood,
    )


def _resolved(folder: Path) -> str:
    try:
        return str(folder.resolve())
    except (OSError, ValueError, RuntimeError):  # a NUL in the name, links in a ring
        return str(folder)
