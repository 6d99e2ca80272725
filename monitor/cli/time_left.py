"""The time left of a bar: by the mean pace so far, from the first piece on, counting down between two pieces."""

from __future__ import annotations

from datetime import timedelta

from rich.progress import ProgressColumn, Task, TaskID
from rich.text import Text


class TimeLeft(ProgressColumn):
    """Shows the time left as soon as one piece is done; rich's own column waits for two, and stands still between them.

    A piece of a report takes twenty seconds on a busy machine.
    """

    def __init__(self) -> None:
        super().__init__()
        self._marks: dict[TaskID, tuple[float, float]] = {}

    def render(self, task: Task) -> Text:
        """Return the time left, dashes where nothing is done yet."""
        elapsed = task.finished_time if task.finished else task.elapsed
        if not task.total or not task.completed or elapsed is None:
            return Text("-:--:--", style="progress.remaining")
        completed, at = self._marks.get(task.id, (0.0, 0.0))
        if completed != task.completed:
            completed, at = self._marks[task.id] = task.completed, elapsed
        seconds = seconds_left(completed, task.total, at, elapsed)
        return Text(str(timedelta(seconds=round(seconds))), style="progress.remaining")


def seconds_left(completed: float, total: float, at: float, elapsed: float) -> float:
    """Return the seconds left where ``completed`` of ``total`` were done ``at`` so many seconds of ``elapsed``."""
    return max(0.0, at * total / completed - elapsed)
