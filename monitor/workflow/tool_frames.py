"""Where a machine without errors brings its tool, for what the readers ask of a campaign."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from monitor.readers.doubts.tool_frames import ToolFrames
from monitor.records import Array, Campaign


def tool_frames(campaign: Campaign) -> ToolFrames:
    """Return what gives the frames (m, 3, 4) of the tool at rows (m,) of a campaign, seen from the work side, in mm."""

    def frames(rows: npt.NDArray[np.int64]) -> Array:
        # Loaded here: few campaigns have rows that are asked for, and the chain takes a tenth of a second.
        from monitor.effects.context import positions_of
        from monitor.machine import evaluate
        from monitor.methods.model import chain_of

        chain, none = chain_of(campaign.machine), np.zeros(3)
        positions = positions_of(chain, campaign.probings.rows(rows).readings)
        pose = evaluate(chain, positions, np.zeros((len(chain.joints), 2, 6)), none, none)
        return np.concatenate([pose.by_tip, pose.residual[:, :, None]], axis=2)

    return frames
