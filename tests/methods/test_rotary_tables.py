"""Tables 5 and 6 of Ibaraki, Iritani, Matsushita 2012 by Monte Carlo over the errors of the linear axes, Eq. (22).

The closed forms are linear in the touched positions to second order, so a trial is a product with their derivatives
(a check against the exact simulator is below). The paper does not print where on the block the points lie (Fig. 6 is a
drawing); ``block`` of the simulator is a layout of 28 and 14 points that fits its numbers.

What fits the print: the columns of the probing, of the linear errors (1 µm per 100 mm, not per mm) and of the
squarenesses as printed. Those of the errors between interpolation nodes fit 1 µm for positioning and 3 µm for
straightness, where the table says 2 µm for both. One number fits nothing: E_yx on beta_AY is printed as 0.0, but
pattern 4 reads the slope of E_yx. Table 6 is tested with the 2 µm of the table.
"""

from __future__ import annotations

import importlib
import importlib.util
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from by_path import load

reference = load("closed_forms", Path(__file__).with_name("closed_forms.py"))
PARAMETERS, SYMBOLS, Touches = reference.PARAMETERS, reference.SYMBOLS, reference.Touches
closed_forms = reference.closed_forms

TABLES = json.loads((Path(__file__).parents[1] / "references/papers/ibaraki2012.json").read_text())
MDEG = np.pi / 180e3
RUNS = 4000  # 1000 in the paper; more make the test steadier
PITCH = (20.0, 50.0)


class Layout:
    """The paper's 154 touches and what the closed forms make of a deviation of each along its normal."""

    def __init__(self, simulator, height=160.0) -> None:
        rp = importlib.import_module("simulator.rotary_probing")
        self.rp, self.plan = rp, rp.paper_plan(rp.block(height=height))
        self.chain = sys.modules["simulator.chain"].read_topology("w C A Y b X Z t")
        seen = rp.touch(self.chain, self.plan, {}, np.random.default_rng(0))
        self.position = np.column_stack([seen[axis] for axis in "XYZ"])
        self.angles = np.radians(seen["A"]), np.radians(seen["C"])
        self.normal = np.array([one.normal for one, _ in self.plan])
        self.names = np.array([one.target for one, _ in self.plan])
        turned = [rp._rotation("A", -a) @ rp._rotation("C", -c) for a, c in zip(*self.angles, strict=True)]
        self.direction = np.einsum("nij,nj->ni", turned, self.normal)
        nothing = self.identified(self.position)
        columns = []
        for row in range(len(self.plan)):
            moved = self.position.copy()
            moved[row] += 1e-3 * self.direction[row]
            columns.append((self.identified(moved) - nothing) / 1e-3)
        self.slopes = np.array(columns).T  # (8, 154)

    def identified(self, position) -> np.ndarray:
        return closed_forms(Touches(position, *self.angles, self.names, self.normal))

    def spread(self, deviation_um) -> np.ndarray:
        """Standard deviations (8,) in µm and mdeg for deviations (runs, 154) along the normals in µm."""
        found = 1e-3 * deviation_um @ self.slopes.T
        return found.std(axis=0) / np.where([name[1] in "XYZ" for name in PARAMETERS], 1e-3, MDEG)

    def proportional(self, rng, axis: int, component: int, um_per_mm: float) -> np.ndarray:
        return rng.normal(0.0, um_per_mm, (RUNS, 1)) * self.position[:, axis] * self.direction[:, component]

    def interpolated(self, rng, axis: int, component: int, um: float) -> np.ndarray:
        """Eq. (22): random values at nodes a random distance apart, straight lines between."""
        q = self.position[:, axis]
        found = np.empty((RUNS, len(q)))
        for run in range(RUNS):
            pitch = rng.uniform(*PITCH)
            nodes = np.arange(np.floor(q.min() / pitch), np.ceil(q.max() / pitch) + 1.0)
            found[run] = np.interp(q, pitch * nodes, rng.normal(0.0, um, len(nodes)))
        return found * self.direction[:, component]

    def contributions(self, rng, positioning_um: float, straightness_um: float) -> dict[str, np.ndarray]:
        """Standard deviations (8,) by contributor."""
        noise = rng.standard_normal((RUNS, len(self.plan)))
        found = {"probing": self.spread(0.7 * noise), "roughness": self.spread(noise[::-1])}
        for axis, letter in enumerate("xyz"):
            found[f"E_{letter}{letter},lin"] = self.spread(self.proportional(rng, axis, axis, 0.01))
            for component, other in enumerate("xyz"):
                size = positioning_um if component == axis else straightness_um
                found[f"E_{other}{letter}"] = self.spread(self.interpolated(rng, axis, component, size))
        for name, axis, component in (("S_xy", 1, 0), ("S_xz", 2, 0), ("S_yz", 2, 1)):
            found[name] = self.spread(self.proportional(rng, axis, component, 0.03))
        return found


@pytest.fixture(scope="module")
def layout(simulator) -> Layout:
    return Layout(simulator)


DY, BETA = PARAMETERS.index("EY0A"), PARAMETERS.index("EB0A")
PRINTED = {
    # contributor: on dy_AY (µm), on beta_AY (mdeg)
    "probing": (0.3, 0.5), "roughness": (0.5, 0.7),
    "E_xx,lin": (0.0, 0.0), "E_xx": (0.0, 0.0), "E_yx": (1.6, None), "E_zx": (0.2, 0.3),
    "E_yy,lin": (0.4, 0.0), "E_yy": (0.6, 0.0), "E_xy": (0.0, 0.4), "E_zy": (1.7, 0.0), "S_xy": (0.0, 1.5),
    "E_zz,lin": (0.4, 0.0), "E_zz": (0.6, 0.0), "E_xz": (0.0, 0.3), "E_yz": (1.5, 0.0), "S_xz": (0.0, 0.2),
    "S_yz": (5.5, 0.0),
}  # fmt: skip


def near(found: float, printed: float) -> bool:
    """Within 10 % of what a number printed with one decimal may stand for."""
    return abs(found - printed) <= 0.1 * printed + 0.05


def test_table_5_contributions_of_probing_linear_errors_and_squareness(layout):
    found = layout.contributions(np.random.default_rng(5), 2.0, 2.0)
    for name in ("probing", "roughness", "E_xx,lin", "E_yy,lin", "E_zz,lin", "S_xy", "S_xz", "S_yz"):
        for place, printed in zip((DY, BETA), PRINTED[name], strict=True):
            assert near(found[name][place], printed), (name, found[name][place], printed)


def test_e03_one_micrometre_per_millimetre_is_a_hundred_times_too_much(layout):
    rng = np.random.default_rng(3)
    printed = layout.spread(layout.proportional(rng, 1, 1, 1.0))[DY]
    assert printed == pytest.approx(40.0, rel=0.05)  # Table 5 has 0.4


def test_table_5_contributions_between_the_nodes_fit_1_and_3_micrometres(layout):
    found = layout.contributions(np.random.default_rng(13), 1.0, 3.0)
    wrong = {
        (name, place): (found[name][place], value)
        for name, printed in PRINTED.items()
        for place, value in zip((DY, BETA), printed, strict=True)
        if value is not None and not near(found[name][place], value)
    }
    # E_xz on beta_AY comes out at 0.42 mdeg, 0.3 printed: how the heights of the points are spread is not known.
    assert set(wrong) <= {("E_xz", BETA)}, wrong
    assert found["E_yx"][BETA] > 1.0  # printed 0.0: the angle of pattern 4 is a slope of E_yx


def test_table_6_combined_uncertainties_within_15_per_cent(layout):
    found = layout.contributions(np.random.default_rng(6), 2.0, 2.0)
    combined = dict(zip(PARAMETERS, np.sqrt(sum(one**2 for one in found.values())), strict=True))
    for key, printed in TABLES["table_6"]["u"].items():
        symbol = key.rpartition("_")[0]
        found_u = combined[SYMBOLS[symbol]]
        if symbol == "dy_CA":
            # 3.5 printed. Neither 2 and 2 µm, nor 1 and 3 µm, nor Eq. (17) as printed comes near it.
            assert found_u == pytest.approx(2.4, rel=0.1)
        else:
            assert abs(found_u - printed) <= 0.15 * printed + 0.05, (symbol, found_u, printed)


def test_table_6_no_height_of_the_side_rows_explains_dy_ca(simulator, layout, monkeypatch):
    """docs/rotary-probing.md: 2.4 and 2.7 µm with rows at 160 and 135 mm, 5.3 and 4.6 µm by Eq. (17) as printed; 3.5
    printed."""
    monkeypatch.setattr(sys.modules[__name__], "RUNS", 1000)
    of_y, of_c = PARAMETERS.index("EY0A"), PARAMETERS.index("EY0C")
    for rows, expected, as_printed in ((layout, 2.4, 5.3), (Layout(simulator, 135.0), 2.7, 4.6)):
        right = rows.slopes
        found = []
        # dy_CA = s - dy_AY with s the half sum; as printed the sum itself stands there.
        for slope in (right[of_c], 2.0 * (right[of_c] + right[of_y]) - right[of_y]):
            rows.slopes = right.copy()
            rows.slopes[of_c] = slope
            parts = rows.contributions(np.random.default_rng(6), 2.0, 2.0).values()
            found.append(float(np.sqrt(sum(part[of_c] ** 2 for part in parts))))
        rows.slopes = right
        assert found == pytest.approx([expected, as_printed], rel=0.05)


@pytest.mark.slow
def test_table_6_rows_at_60_mm_give_dy_ca_and_lose_dx_ay(simulator, monkeypatch):
    """docs/rotary-probing.md: all but dx_AY fits rows low on the sides, dx_AY alone asks for 170 mm or more."""
    monkeypatch.setattr(sys.modules[__name__], "RUNS", 1000)
    low = Layout(simulator, 60.0)
    parts = low.contributions(np.random.default_rng(6), 2.0, 2.0).values()
    u = dict(zip(PARAMETERS, np.sqrt(sum(part**2 for part in parts)), strict=True))
    assert (u["EY0C"], u["EZ0A"]) == (pytest.approx(3.5, rel=0.1), pytest.approx(4.6, rel=0.1))
    assert u["EX0A"] == pytest.approx(2.8, rel=0.1)  # 5.7 printed


def test_e11_the_printed_columns_do_not_add_up_to_table_6_exactly():
    columns = np.array([[a, 0.0 if b is None else b] for a, b in PRINTED.values()])
    assert np.sqrt(np.sum(columns**2, axis=0)) == pytest.approx([6.27, 1.84], abs=0.01)
    assert [TABLES["table_6"]["u"][key] for key in ("dy_AY_um", "beta_AY_mdeg")] == [6.0, 2.0]


def test_place_and_orientation_of_the_piece_contribute_nothing(layout):
    rng = np.random.default_rng(8)
    found = []
    for _ in range(20):
        piece = layout.rp.Piece(
            shift=tuple(rng.normal(0.0, [0.010, 0.010, 0.120])), turn=tuple(rng.normal(0.0, 1e-4, 3))
        )
        seen = layout.rp.touch(layout.chain, layout.plan, {}, rng, piece=piece)
        found.append(layout.identified(np.column_stack([seen[axis] for axis in "XYZ"])))
    spread = np.std(found, axis=0)
    assert np.all(spread[[DY, BETA]] < [0.05e-3, 0.05 * MDEG])  # printed as 0


def test_a_trial_is_linear_in_the_errors_of_the_linear_axes(layout):
    rng = np.random.default_rng(9)
    gain = rng.normal(0.0, 1e-5, 3)
    square = rng.normal(0.0, 3e-5, 3)

    def linear(xyz):
        x, y, z = xyz.T
        return np.column_stack(
            [gain[0] * x + square[0] * y + square[1] * z, gain[1] * y + square[2] * z, gain[2] * z]
        )

    seen = layout.rp.touch(layout.chain, layout.plan, {}, rng, linear=linear)
    exact = layout.identified(np.column_stack([seen[axis] for axis in "XYZ"]))
    # An error that carries the tip outwards makes the axes stop short by as much.
    deviation = -np.sum(linear(layout.position) * layout.direction, axis=1)
    np.testing.assert_allclose(layout.slopes @ deviation, exact, atol=2e-7)
