"""Long-term health database for machine tools and coordinate measuring machines.

The rooms, from left to right, each importing only those to its left and the ground
(``exceptions``, ``units``, ``records``):

machine, effects, methods, uncertainty, statistics, discovery, store, reporting, workflow, cli and web.
``readers`` imports the ground only.
"""

__version__ = "0.1.0"
