"""Campaign folders into the database, all or nothing each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from monitor.exceptions import CampaignError, InputError, StoreError
from monitor.readers import doubts, names_in, read_campaign
from monitor.records import CurveCampaign
from monitor.store import (
    Database,
    Imported,
    campaign_notes,
    clear_refusals,
    import_campaign,
    import_curve,
    record_refusal,
)
from monitor.workflow.intake.copied_runs import check_copies
from monitor.workflow.intake.curve_base import check_base
from monitor.workflow.intake.gross_doubts import gross_doubts


@dataclass(frozen=True)
class ImportRequest:
    """The folders to be imported, in this order."""

    folders: Sequence[Path]


@dataclass(frozen=True)
class ImportedFolder:
    """What the import of a folder did: "imported", or "unchanged" where its content was in the database already.

    ``rows`` is the number of rows of a curve, None for the campaign of a machine; ``notes`` say what may be a mistake.
    """

    campaign: str
    folder: str
    state: str
    runs: int
    probings: int
    rows: int | None
    notes: tuple[str, ...]
    message: str


@dataclass(frozen=True)
class RefusedFolder:
    """A folder of which nothing was kept, and why: all its faults in one text."""

    folder: str
    why: str


@dataclass(frozen=True)
class ImportAnswer:
    """The imported folders in their order, and those that were refused."""

    imported: tuple[ImportedFolder, ...]
    refused: tuple[RefusedFolder, ...] = ()


def import_folders(
    db: Database, request: ImportRequest, *, progress: Callable[[str], None] = lambda name: None
) -> ImportAnswer:
    """Import every folder, all or nothing each; one that is refused does not hinder the others.

    Every refusal is recorded. Raises CampaignError with all faults of a folder that was asked for alone, StoreError
    where the database cannot be written.
    """
    answers: list[ImportedFolder] = []
    refused: list[RefusedFolder] = []
    for folder in request.folders:
        progress(str(folder))
        try:
            imported = _import(db, Path(folder))
        except StoreError as error:
            if not answers:
                raise
            before = ", ".join(answer.campaign for answer in answers)
            raise StoreError(f"{error}\nIn the database before it was met: {before}") from error
        except InputError as error:
            if len(request.folders) == 1:
                raise
            refused.append(RefusedFolder(str(folder), str(error)))
        else:
            answers.append(_answer(db, folder, imported))
    return ImportAnswer(tuple(answers), tuple(refused))


def _import(db: Database, folder: Path) -> Imported:
    """Import one folder, which settles earlier refusals of it or of its campaign, or record that it was refused."""
    path = _resolved(folder)
    try:
        campaign = read_campaign(folder)
        if isinstance(campaign, CurveCampaign):
            check_base(campaign)
            imported = import_curve(db, campaign)
        else:
            if campaign.sources:
                # Loaded here: hardly any campaign states sources, and the solver takes a third of a second.
                from monitor.workflow.intake.checked_sources import check_sources

                check_sources(campaign)
            notes = (*check_copies(db, campaign), *doubts(campaign), *gross_doubts(campaign))
            imported = import_campaign(db, campaign, notes)
    except StoreError:
        # Nothing is wrong with the folder; and where the database cannot be written nothing can be recorded.
        raise
    except InputError as error:
        faults = [str(fault) for fault in error.faults] if isinstance(error, CampaignError) else [str(error)]
        name, machine = names_in(folder)
        with suppress(StoreError):  # the faults of the folder are what the user has to hear
            record_refusal(db, path, faults, campaign=name, machine=machine)
        raise
    clear_refusals(db, path, imported.campaign)
    return imported


def _answer(db: Database, folder: Path, imported: Imported) -> ImportedFolder:
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
    )


def _resolved(folder: Path) -> str:
    try:
        return str(folder.resolve())
    except (OSError, ValueError, RuntimeError):  # a NUL in the name, links in a ring
        return str(folder)
