"""What a second set-up is that tells effects apart where no pose of the first one does, in words."""

from __future__ import annotations

from monitor.records import SecondSetup

_ANEW = "with the targets clamped anew"

#: Words for the sizes of ``discovery.machine.separation.setups``.
IN_WORDS = {
    SecondSetup.LONGER_STYLUS: "with a stylus 50 mm longer or shorter",
    SecondSetup.STYLUS_BESIDE: "with a star stylus whose tip stands 50 mm beside the present one",
    SecondSetup.TURNED: f"{_ANEW}, turned by 45° about the axis that carries them",
    SecondSetup.FURTHER: f"{_ANEW}, 50 mm further across the axis that carries them",
    SecondSetup.HIGHER: f"{_ANEW}, 50 mm further along the axis that carries them",
}
