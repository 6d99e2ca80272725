"""The search for missing effects, the same for whatever can be searched.

``candidate`` is an effect as the data see it, ``scene`` the protocol of what can be searched, ``evidence`` weighs
candidates, ``scan`` searches step by step, ``acceptance`` decides on a finding, ``held_out`` gives errors on readings
that took no part in the fit. ``missing`` and ``comparison`` are the results.
"""
