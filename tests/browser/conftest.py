"""The server and the browser of the session."""

from tests.browser.visits import site

__all__ = ["site"]
