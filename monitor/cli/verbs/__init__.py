"""The verbs, one file each: ``EXAMPLE``, ``options(parser)`` and ``run(options)``."""
