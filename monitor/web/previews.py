"""Previews of certificates: documents that are looked at and stored nowhere; each user has the latest."""

from __future__ import annotations

from collections import OrderedDict
from threading import Lock

from monitor.exceptions import NotFoundError

#: Users whose latest preview is held; a document takes some 100 kB.
MOST = 50


class Previews:
    """Holds the latest preview of each user until the server ends."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._documents: OrderedDict[str, bytes] = OrderedDict()

    def hold(self, user_name: str, document: bytes) -> None:
        """Hold a document in place of the user's one before."""
        with self._lock:
            self._documents.pop(user_name, None)
            self._documents[user_name] = document
            while len(self._documents) > MOST:
                self._documents.popitem(last=False)

    def document_of(self, user_name: str) -> bytes:
        """Return the latest preview of a user. Raises NotFoundError."""
        with self._lock:
            document = self._documents.get(user_name)
        if document is None:
            raise NotFoundError("there is no preview any more: press preview again, nothing of it was stored")
        return document
