"""Names the runs of a campaign that meet a condition, lists such selections and finds them by name.

``hot-cold-star`` is ``hot-cold`` where ``hours >= 6``: Los 2017, 4.6.2, draws the expanded uncertainties with the
covariance of the probed coordinates of each (Figure 4.6).
"""

from __future__ import annotations

from monitor.exceptions import InputError, NotFoundError
from monitor.store import (
    Database,
    StoredSelection,
    find_selection,
    list_campaigns,
    list_selections,
    load_campaign,
    save_selection,
)
from monitor.workflow.run_statistics.columns import campaign_columns, selected
from monitor.workflow.selections.request import (
    SelectionAnswer,
    SelectionRequest,
    SelectionsAnswer,
    SelectionsRequest,
)


def select(db: Database, request: SelectionRequest) -> SelectionAnswer:
    """Name the runs of a campaign that meet a condition; the selection is stored.

    Raises InputError for a name that a campaign or a column of the runs has, a condition that cannot be read, or
    one that no run meets.
    """
    name, where = request.name, request.where
    campaign = load_campaign(db, request.campaign)
    if name in {row.campaign for row in list_campaigns(db)}:
        raise InputError(f"--name {name}: a campaign has that name; a selection needs another")
    columns = campaign_columns(campaign)
    if name in columns:
        raise InputError(
            f"--name {name}: runs are grouped by a column of that name (`stats --by {name}`); a selection needs another"
        )
    meets = selected(columns, where, len(campaign.runs))
    runs = tuple(run.run for run, met in zip(campaign.runs, meets, strict=True) if met)
    if not runs:
        raise InputError(f"--where {where}: no run of campaign {campaign.name} meets it; nothing was kept")
    save_selection(db, campaign.name, name, where, runs)
    return SelectionAnswer(name, campaign.name, where, runs)


def selections(db: Database, request: SelectionsRequest) -> SelectionsAnswer:
    """List the stored selections."""
    return SelectionsAnswer(list_selections(db, request.campaign))


def group(db: Database, name: str, campaign: str | None = None) -> StoredSelection | None:
    """A stored selection of a name, of ``campaign`` first; None where the name is that of a campaign: all its runs.

    Raises NotFoundError listing the selections that there are.
    """
    if campaign is not None and name != campaign:
        try:
            return find_selection(db, name, campaign)
        except NotFoundError:
            pass
    if name in {row.campaign for row in list_campaigns(db)}:
        return None
    return find_selection(db, name)
