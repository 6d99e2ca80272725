"""The search for missing effects, the same for whatever can be searched.

``candidate`` is an effect as the data see it, ``scene`` the protocol of what can be searched, ``evidence`` weighs
candidates, ``steps`` selects one after the other, ``scan`` with the false discovery rate under control, ``rounds``
repeats that while what is left out or the noise changes, ``acceptance`` decides on a finding, ``held_out`` gives errors
on readings that took no part in the fit. ``missing`` and ``comparison`` are the results.
"""
