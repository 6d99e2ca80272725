"""Effects of the artefact: shifts of the targets by hand, in the frame of the last work axis."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from monitor.effects import Context, parse_effect
from monitor.exceptions import EffectError
from monitor.records import Array


def shifts(text: str, context: Context) -> Array:
    basis = parse_effect(text, context.chain).basis(context)
    found: Array = basis.shifts  # type: ignore[union-attr]
    return found


def test_a_ball_that_moved_stays_moved_to_the_end_of_its_run(make: Callable[..., Context]) -> None:
    context = make({"X": [0.0] * 6}, run=[1, 1, 2, 2, 2, 3], target=["1", "2", "2", "1", "2", "2"])
    found = shifts("ball:2:moved(run 2, sequence 4)", context)
    expected = np.zeros((6, 3, 3))
    expected[4] = np.eye(3)
    np.testing.assert_array_equal(found, expected)
    effect = parse_effect("ball:2:moved(run 2, sequence 4)", context.chain)
    assert effect.parameters(context) == tuple(f"ball:2:moved(run 2, sequence 4).{axis}" for axis in "xyz")
    assert parse_effect("ball:2:moved( run 2 , sequence 4 )", context.chain).text == effect.text


def test_a_ball_that_nobody_probed_is_refused_with_those_there_are(make: Callable[..., Context]) -> None:
    context = make({"X": [0.0] * 2}, target=["1", "S1"])
    with pytest.raises(EffectError, match=r"no ball 7; this campaign probed 1, S1"):
        shifts("ball:7:moved(run 1, sequence 1)", context)


def test_expansion_grows_from_the_origin_of_the_table(make: Callable[..., Context]) -> None:
    context = make(
        {"X": [0.0, 0.0]},
        nominal=[[100.0, -20.0, 5.0], [0.0, 0.0, 0.0]],
        columns={"ambient_degC": [23.0, 19.0]},
    )
    found = shifts("artefact:expansion@ambient_degC", context)
    np.testing.assert_allclose(found[:, :, 0], [[300.0, -60.0, 15.0], [0.0, 0.0, 0.0]], rtol=1e-15)
    assert parse_effect("artefact:expansion", context.chain).parameters(context) == ("artefact:expansion",)


def test_stems_bend_across_the_table_axis_only(make: Callable[..., Context]) -> None:
    context = make({"C": [0.0, np.pi / 2, np.pi]}, target=["1", "2", "1"])
    found = shifts("stem:gravity", context)
    expected = np.zeros((3, 3, 2))
    expected[0, :, 0] = (0, -1, 0)
    expected[1, :, 1] = (-1, 0, 0)
    expected[2, :, 0] = (0, 1, 0)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-15)
    assert parse_effect("stem:gravity", context.chain).parameters(context) == (
        "stem:gravity.1",
        "stem:gravity.2",
    )


def test_upright_stems_do_not_bend(make: Callable[..., Context]) -> None:
    # Vertical machine: gravity along the C axis of the table.
    context = make({"C": [0.0, 1.0]}, topology="w C b X Y Z (C1) t")
    np.testing.assert_allclose(shifts("stem:gravity", context), 0.0, atol=1e-15)


def test_a_trunnion_tilts_its_stems(make: Callable[..., Context]) -> None:
    # w C A: A turned by 30 degrees about X; gravity -Z is seen by the table as (0, -sin 30, -cos 30).
    context = make({"A": [np.pi / 6], "C": [0.0]}, topology="w C A Y X b Z (C1) t")
    np.testing.assert_allclose(shifts("stem:gravity", context)[0, :, 0], [0.0, -0.5, 0.0], atol=1e-15)


def test_without_a_work_branch_stems_do_not_turn(make: Callable[..., Context]) -> None:
    context = make({"X": [0.0, 1.0]}, topology="w b X Y Z t", target=["1", "2"])
    np.testing.assert_array_equal(shifts("stem:gravity", context), np.zeros((2, 3, 2)))


def test_lobes_of_a_probe_shift_touched_points_by_the_direction_seen_from_the_tool(
    make: Callable[..., Context],
) -> None:
    """B has turned the piece by a quarter about Y: its X is the machine's -Z, its Z the machine's X. The spindle, with
    the probe, has turned by 30 degrees: the machine's X lies at -30 and its Y at 60 degrees of the probe."""
    columns = {"normal_x": [0.0, 0.0, 1.0], "normal_y": [0.0, 1.0, 0.0], "normal_z": [1.0, 0.0, 0.0]}
    turned = {"B": [np.pi / 2] * 3, "C1": [np.pi / 6] * 3}
    context = make(turned, topology="w B b X Y Z (C1) t", columns=columns)
    three = shifts("probe:lobing3", context)
    np.testing.assert_allclose(three[0], [[0, 0], [0, 0], [0.0, -1.0]], atol=1e-12)
    np.testing.assert_allclose(three[1], [[0, 0], [-1.0, 0.0], [0, 0]], atol=1e-12)
    # Along the probe nothing is across.
    np.testing.assert_allclose(three[2], 0.0, atol=1e-12)
    two = shifts("probe:lobing2", context)
    np.testing.assert_allclose(two[0, 2], [0.5, -np.sqrt(0.75)], atol=1e-12)
    assert parse_effect("probe:lobing2", context.chain).parameters(context) == (
        "probe:lobing2.cos",
        "probe:lobing2.sin",
    )


def test_lobes_need_normals(make: Callable[..., Context]) -> None:
    with pytest.raises(EffectError, match=r"'probe:lobing2' needs the normal of the surface"):
        shifts("probe:lobing2", make({"X": [0.0]}))


def test_displacement_is_against_the_target(make: Callable[..., Context]) -> None:
    context = make({"X": [0.0]}, nominal=[[10.0, 0.0, 0.0]])
    basis = parse_effect("artefact:expansion", context.chain).basis(context)
    np.testing.assert_array_equal(basis.displacement(np.zeros((1, 3, 6, 2, 6)))[0, :, 0], [-10.0, 0.0, 0.0])
    target = np.zeros((1, 3))
    basis.apply(np.array([0.1]), np.zeros((1, 6, 2, 6)), target)
    np.testing.assert_allclose(target, [[1.0, 0.0, 0.0]], rtol=1e-15)


def test_a_piece_that_slipped_is_shifted_and_turned_to_the_end_of_its_run(
    make: Callable[..., Context],
) -> None:
    places = [[30.0, 0.0, 0.0], [-30.0, 0.0, 0.0], [0.0, 40.0, 0.0], [0.0, -40.0, 0.0], [30.0, 0.0, 0.0]]
    context = make({"X": [0.0] * 5}, run=[1, 1, 1, 1, 2], target=["1", "2", "3", "4", "1"], nominal=places)
    found = shifts("artefact:moved(run 1, sequence 2)", context)
    assert found.shape == (5, 3, 6)
    np.testing.assert_array_equal(found[[0, 4]], 0.0)
    np.testing.assert_array_equal(found[1, :, :3], np.eye(3))
    # A turn about Z by 1 at the farthest, 40 mm off the middle: at 30 mm three quarters, across.
    np.testing.assert_allclose(found[1, :, 5], [0.0, -0.75, 0.0], rtol=0, atol=1e-15)
    np.testing.assert_allclose(found[2, :, 5], [-1.0, 0.0, 0.0], rtol=0, atol=1e-15)


def test_a_piece_of_unknown_places_is_shifted_only(make: Callable[..., Context]) -> None:
    context = make({"X": [0.0] * 2}, nominal=[[np.nan] * 3] * 2)
    found = shifts("artefact:moved(run 1, sequence 1)", context)
    np.testing.assert_array_equal(
        found, np.tile(np.concatenate([np.eye(3), np.zeros((3, 3))], axis=1), (2, 1, 1))
    )


def test_a_slip_must_say_when(make: Callable[..., Context]) -> None:
    with pytest.raises(EffectError, match=r"write artefact:moved\(run 7, sequence 23\)"):
        parse_effect("artefact:moved", make({"X": [0.0]}).chain)
