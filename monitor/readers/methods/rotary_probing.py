"""The method ``rotary-probing``: touching a test piece at indexed angles of two rotary axes."""

from __future__ import annotations

from monitor.readers.method_rules import MethodRules

RULES = MethodRules("rotary-probing")
