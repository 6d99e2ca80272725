"""The error of blocks of poses left out of a single run, against least squares without them."""

from __future__ import annotations

import numpy as np

from monitor.discovery.machine.evidence.held_out import LeftOutBlocks


def test_what_only_the_part_left_out_determines_is_not_predicted():
    """A shape that shows at the poses of one part alone, but for 1e-3 of it elsewhere, where noise alone says how large
    it is: the error at left-out poses was 0.135 mm in place of 0.61 um in a campaign of a straightness."""
    rng = np.random.default_rng(5)
    rows, parts = 500, np.arange(500) // 50
    basis = np.linalg.qr(rng.normal(size=(rows, 4)))[0]
    slope = np.linspace(-1.0, 1.0, rows)
    local = np.where(parts == 3, 1.0, 1e-3) * rng.normal(size=rows)
    columns = np.column_stack([slope, local])
    columns -= basis @ (basis.T @ columns)
    residual = 3.0 * slope + rng.normal(size=rows)
    residual -= basis @ (basis.T @ residual)
    whole = np.column_stack([basis, columns[:, 0]])
    expected = 0.0
    for part in range(10):
        left_out = parts == part
        sizes = np.linalg.lstsq(whole[~left_out], residual[~left_out], rcond=None)[0]
        expected += float(np.sum((residual[left_out] - whole[left_out] @ sizes) ** 2))
    error = LeftOutBlocks(basis, parts).sum_of_squares(residual, columns)
    assert abs(error / expected - 1.0) < 0.05
