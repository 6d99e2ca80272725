"""Steps of a scale in a map and its tables: places that no position tells apart make the errors said of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from by_path import load

from monitor.uncertainty.volumetric import grid, middle, volumetric_error
from monitor.workflow.volumetric.between_points import between_points, step_places
from monitor.workflow.volumetric.compensation import write_tables
from monitor.workflow.volumetric.over_stroke import _difference

compensation = load("compensation_of_machines", Path(__file__).with_name("test_compensation.py"))
TOPOLOGIES = ("w b X Y Z t", "w C B X b Z Y (C1) t")


def _mapped(topology, *, absolute=False, **values):
    """A map of X readings from -210 to 190 mm, measured at both ends and at 0, with its zero at -10."""
    truth = SimpleNamespace(values=values)
    mapped = compensation._mapped(truth, topology, compensation._signs(topology, True), points=9)
    if not absolute:
        return mapped
    points = grid(mapped.errors.chain, mapped.ranges, 9, mapped.poses)
    return replace(mapped, error=volumetric_error(mapped.errors, points, None))


def _apart(first, second):
    """How far the errors of two maps are apart at every point, µm, and the readings of X there."""
    axis = first.errors.chain.index("X")
    readings = first.errors.chain.joints[axis].sign * first.error.positions[:, axis]
    return 1e3 * np.linalg.norm(first.error.vectors - second.error.vectors, axis=1), readings


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_two_places_between_the_same_positions_differ_where_it_is_said(topology):
    early, late = (_mapped(topology, **{f"EXX:step({at})": 6e-3}) for at in (12, 150))
    (place,) = step_places(early)
    assert (place.parameter, place.axis, place.unit) == ("EXX:step(12)", "X", "µm")
    assert (place.low_mm, place.high_mm, place.zero_between) == (0.0, 190.0, False)
    assert place.size == pytest.approx(6.0)
    apart, readings = _apart(early, late)
    between = (readings > 0.0) & (readings < 190.0)
    assert np.abs(apart[~between]).max() < 1e-6
    assert apart[between].max() == pytest.approx(6.0)


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_where_the_zero_lies_between_all_points_differ(topology):
    before, after = (_mapped(topology, **{f"EXX:step({at})": 6e-3}) for at in (-12, -8))
    (place,) = step_places(before)
    assert (place.low_mm, place.high_mm, place.zero_between) == (-210.0, 0.0, True)
    apart, _ = _apart(before, after)
    at_zero = middle(before.errors.chain, before.ranges)
    beyond = np.any(np.abs(before.error.positions - at_zero) > 1e-9, axis=1)
    assert np.median(apart[beyond]) == pytest.approx(6.0)
    absolute = _mapped(topology, absolute=True, **{"EXX:step(-12)": 6e-3})
    assert not step_places(absolute)[0].zero_between


def test_each_step_has_its_own_readings_and_size_and_a_width_adds_its_halves():
    mapped = _mapped("w b X Y Z t", **{"EXX:step8mm(-3,110)": (6e-3, -4e-3), "EBX:step(20)": 5e-6})
    first, second, turned = step_places(mapped)
    # Over 8 mm about -3 the position 0 tells something, but not all of it: the next beyond is at 190.
    assert (first.parameter, first.low_mm, first.high_mm) == ("EXX:step8mm(-3,110).-3mm", -210.0, 190.0)
    assert (second.parameter, second.low_mm, second.high_mm) == ("EXX:step8mm(-3,110).110mm", 0.0, 190.0)
    assert (first.size, second.size) == pytest.approx((6.0, 4.0))
    assert (turned.parameter, turned.unit, turned.size) == ("EBX:step(20)", "µrad", pytest.approx(5.0))


def test_a_step_over_a_width_has_rows_where_it_begins_and_ends(tmp_path):
    """Even rows leave half a step within the width, however often they are doubled: it took 2049 of them."""
    mapped = _mapped("w b X Y Z t", **{"EXX:step8mm(12)": 6e-3, "EXX:poly1": 1e-5})
    (path,) = write_tables(mapped, "positioning-csv", tmp_path)
    header, rows = compensation._table(path)
    nodes, errors = np.array([[row["reading_mm"], row["error_um"]] for row in rows]).T
    assert len(rows) == 33 + 2
    readings = np.linspace(-210.0, 190.0, 20001)
    sign = mapped.errors.chain.joints[mapped.errors.chain.index("X")].sign
    straight = np.interp(readings, nodes, errors) - 6.0 * sign * np.clip((readings - 12.0) / 8.0, -0.5, 0.5)
    # What is not the step is a straight line.
    assert np.abs(straight - np.polyval(np.polyfit(readings, straight, 1), readings)).max() < 0.001
    assert not any("jumps" in line for line in header)
    assert any("PLACE UNKNOWN EXX:step8mm(12), a step of 6.0 µm" in line for line in header)


@pytest.mark.parametrize("other", ["EYX:step(12)", "EYX:sawtooth84mm(12)", "EBX:step(12)", "EZX:step8mm(12)"])
def test_jumps_of_other_errors_are_no_matter_of_a_positioning_table(other, tmp_path):
    size = 5e-6 if other.startswith("EBX") else 6e-3
    mapped = _mapped("w b X Y Z t", **{"EXX:poly1": 1e-5, other: size})
    (path,) = write_tables(mapped, "positioning-csv", tmp_path)
    header, rows = compensation._table(path)
    assert len(rows) == 33
    assert not any("jumps" in line or other in line for line in header)
    (path,) = write_tables(mapped, "volumetric-csv", tmp_path)
    assert any(other in line for line in compensation._table(path)[0])


def test_the_difference_of_two_maps_has_the_change_of_a_step_and_of_what_repeats():
    both = [
        _mapped("w b X Y Z t", **{"EXX:step(12)": step, "EXX:cyclic68mm": (wave, 0.0)})
        for step, wave in ((6e-3, 4e-3), (1e-3, 1e-3))
    ]
    first, second = (
        replace(mapped, evaluated=SimpleNamespace(run=run)) for run, mapped in enumerate(both, 1)
    )
    change = _difference(first, second)
    assert [place.size for place in step_places(change)] == pytest.approx([5.0])
    assert [wave.size for wave in between_points(change)] == pytest.approx([3.0], rel=0.01)
    same = _difference(first, replace(first, evaluated=second.evaluated))
    assert (step_places(same), between_points(same)) == ((), ())
