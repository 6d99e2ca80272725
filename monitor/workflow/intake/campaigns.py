"""Campaign folders into the database, and what is there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Any

from monitor.exceptions import CampaignError, InputError, NotFoundError, StoreError
from monitor.readers import doubts, names_in, read_campaign
from monitor.records import Campaign, CurveCampaign
from monitor.store import (
    Database,
    Imported,
    campaign_notes,
    clear_refusals,
    import_campaign,
    import_curve,
    list_campaigns,
    list_runs,
    list_withdrawn,
    load_campaign,
    record_refusal,
)
from monitor.workflow.intake.copied_runs import check_copies
from monitor.workflow.intake.curve_base import check_base

Document = dict[str, Any]


def import_folders(
    db: Database, folders: Sequence[Path], progress: Callable[[str], None] = lambda name: None
) -> Document:
    """Import every folder, all or nothing each; the first refusal stops, what was imported before stays.

    Raises CampaignError with all faults of the folder that is refused; that it was refused is recorded.
    """
    done: list[Document] = []
    for folder in folders:
        progress(str(folder))
        try:
            imported = _import(db, Path(folder))
        except InputError as error:
            if not done:
                raise
            before = ", ".join(one["campaign"] for one in done)
            raise InputError(f"{error}\nIn the database before it was met: {before}") from error
        done.append(
            {
                "campaign": imported.campaign,
                "folder": str(folder),
                "state": imported.state,
                "runs": imported.runs,
                "probings": imported.probings,
                "rows": imported.rows,
                "notes": _notes(db, imported),
                "message": str(imported),
            }
        )
    return {"imported": done}


def _import(db: Database, folder: Path) -> Imported:
    """Import one folder, which settles earlier refusals of it or of its campaign, or record that it was refused."""
    place = _whole(folder)
    try:
        found = read_campaign(folder)
        if isinstance(found, CurveCampaign):
            check_base(found)
            imported = import_curve(db, found)
        else:
            notes = (*check_copies(db, found), *doubts(found))
            imported = import_campaign(db, found, notes)
    except StoreError:
        # Nothing is wrong with the folder; and where the database cannot be written nothing can be recorded.
        raise
    except InputError as error:
        faults = [str(fault) for fault in error.faults] if isinstance(error, CampaignError) else [str(error)]
        campaign, machine = names_in(folder)
        with suppress(StoreError):  # the faults of the folder are what the user has to hear
            record_refusal(db, place, faults, campaign=campaign, machine=machine)
        raise
    clear_refusals(db, place, imported.campaign)
    return imported


def _notes(db: Database, imported: Imported) -> list[str]:
    """What was noticed at this import; nothing of a campaign that was there already."""
    return list(campaign_notes(db, imported.campaign)) if imported.state == "imported" else []


def _whole(folder: Path) -> str:
    try:
        return str(folder.resolve())
    except (OSError, ValueError, RuntimeError):  # a NUL in the name, links in a ring
        return str(folder)


def campaigns(db: Database) -> Document:
    """The campaigns in the database, and those that were withdrawn."""
    return {
        "campaigns": records(list_campaigns(db)),
        "withdrawn": records(list_withdrawn(db).drop(columns="campaign_id")),
    }


def runs(db: Database, campaign: str) -> Document:
    """The runs of a campaign with their conditions."""
    return {
        "campaign": campaign,
        "runs": records(list_runs(db, campaign)),
        "notes": list(campaign_notes(db, campaign)),
    }


def records(frame: Any) -> list[Document]:
    """The rows of a table as JSON knows them; moments in ISO 8601, with Z where they are in UTC."""
    return [
        {str(key): _plain(value, str(key)) for key, value in row.items()} for row in frame.to_dict("records")
    ]


def _plain(value: Any, name: str = "") -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, datetime):
        # The store keeps UTC without its zone; local times are named so.
        zone = "Z" if value.tzinfo is None and not name.endswith("_local") else ""
        return None if str(value) == "NaT" else value.isoformat() + zone
    if hasattr(value, "isoformat"):
        return None if str(value) == "NaT" else value.isoformat()
    if hasattr(value, "tolist"):
        return value.tolist()
    return None if value != value else value


def chosen(db: Database, campaign: str | None) -> list[str]:
    """The campaign named, or all. Raises NotFoundError where there is none."""
    if campaign is not None:
        return [campaign]
    found = [str(name) for name in list_campaigns(db)["campaign"]]
    if not found:
        raise NotFoundError("the database has no campaign yet; type `monitor import FOLDER`")
    return found


def load(db: Database, campaign: str) -> Campaign:
    """A campaign by its name."""
    return load_campaign(db, campaign)
