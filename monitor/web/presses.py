"""Does once what a form asks for, however often the same page sends it: two clicks, a reload of what was sent.

Every form carries a number of its own (``once``), drawn when its page was made; with what was filled in it names a
press.
What was refused is forgotten, so that the form can be corrected and sent again.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeVar

Answer = TypeVar("Answer")
#: Presses whose answers are held; the oldest is forgotten.
MOST = 1000


class Presses:
    """The answers of the forms that were sent last."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._answers: OrderedDict[str, Future[Any]] = OrderedDict()

    def once(
        self, press: str, work: Callable[[], Answer], is_done: Callable[[Answer], bool] = lambda answer: True
    ) -> Answer:
        """Do the work of a press, or return the answer of the same press before, waiting for it.

        ``is_done`` says whether an answer is held; what raises never is. An empty ``press`` is no form of a page.
        """
        if not press:
            return work()
        future: Future[Answer] = Future()
        with self._lock:
            earlier = self._answers.setdefault(press, future)
            while len(self._answers) > MOST:
                self._answers.popitem(last=False)
        if earlier is not future:
            answer: Answer = earlier.result()
            return answer
        try:
            answer = work()
        except BaseException as error:
            self._forget(press)
            future.set_exception(error)
            raise
        if not is_done(answer):
            self._forget(press)
        future.set_result(answer)
        return answer

    def is_known(self, press: str) -> bool:
        """Whether a form was sent before: what it does is done, or being done."""
        with self._lock:
            return press in self._answers

    def _forget(self, press: str) -> None:
        with self._lock:
            self._answers.pop(press, None)
