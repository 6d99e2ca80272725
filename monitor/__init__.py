"""Long-term health database for machine tools and coordinate measuring machines.

The rooms, from the lowest: ``machine``, ``readers``, ``statistics``, ``store`` and ``reporting`` import the ground
alone (``exceptions``, ``units``, ``records``, ``documents``); above them stand ``effects``, ``methods``,
``uncertainty`` and ``discovery``, ``workflow``, and ``cli``.
"""

__version__ = "0.1.0"
