"""Identifies all campaigns: one that cannot be identified does not hinder the others.

What is computed may be spread over processes or a cluster; this process alone has the database.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from monitor.exceptions import DataError, InputError, NotFoundError
from monitor.progress import told, within
from monitor.records import Campaign, CurveCampaign
from monitor.store import Database, StoredModel, list_campaigns
from monitor.uncertainty.workers.engine import in_order
from monitor.workflow.engines import check_workers, engine_of
from monitor.workflow.identify.answer import IdentificationsAnswer, IdentifyAnswer, RefusedCampaign
from monitor.workflow.identify.identify import Identified, compute, read, store
from monitor.workflow.identify.request import IdentifyRequest


@dataclass(frozen=True)
class IdentifyAllRequest:
    """Identify every campaign, by default under the model of its machine or method.

    ``workers`` processes of this machine compute, or those of the Dask cluster at ``cluster``, by default this process
    alone; the results do not depend on it.
    """

    model: str | None = None
    workers: int | None = None
    cluster: str | None = None

    def __post_init__(self) -> None:
        check_workers(self.workers, self.cluster)


#: A campaign with its model, or why it could not be read.
_Task = tuple[Campaign | CurveCampaign, StoredModel] | str


def identify_all(
    db: Database, request: IdentifyAllRequest, *, progress: Callable[[str], None] = lambda name: None
) -> IdentificationsAnswer:
    """Identify and store every campaign, each by itself. Raises NotFoundError where there is no campaign yet."""
    names = [row.campaign for row in list_campaigns(db)]
    if not names:
        raise NotFoundError("the database has no campaign yet; type `monitor import FOLDER`")
    in_hand: deque[tuple[str, _Task]] = deque()

    def tasks() -> Iterator[tuple[_Task]]:
        for name in names:
            task: _Task
            try:
                task = read(db, IdentifyRequest(name, request.model))
            except (DataError, InputError) as error:
                task = str(error)
            in_hand.append((name, task))
            yield (task,)

    answers: list[IdentifyAnswer] = []
    refused: list[RefusedCampaign] = []
    with engine_of(request.workers, request.cluster) as engine:
        results = in_order(engine, _attempted, tasks())
        for index in range(len(names)):
            with within(index / len(names), (index + 1) / len(names)):
                result = next(results)
                told(1.0)
            name, task = in_hand.popleft()
            progress(name)
            if isinstance(task, str) or isinstance(result, str):
                refused.append(RefusedCampaign(name, str(result)))
                continue
            try:
                answers.append(store(db, *task, result))
            except (DataError, InputError) as error:
                refused.append(RefusedCampaign(name, str(error)))
        # There is no more: what hands the results out ends while its engine is still there.
        deque(results, maxlen=0)
    return IdentificationsAnswer(tuple(answers), tuple(refused))


def _attempted(task: _Task) -> Identified | str:
    """What was identified, or why it could not be: one campaign does not stop the others."""
    if isinstance(task, str):
        return task
    try:
        return compute(*task)
    except (DataError, InputError) as error:
        return str(error)
