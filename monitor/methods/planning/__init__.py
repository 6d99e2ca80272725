"""Plans of touches before anyone measures, for methods whose problem is a ``TouchProblem``."""
