"""Every shape of the language, column by column, by numbers worked out by hand."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from monitor.effects import Context, drivers, parse_effect, registry, shapes
from monitor.effects.words import describe
from monitor.exceptions import EffectError
from monitor.machine import Joint, parse_topology
from monitor.records import Array
from monitor.units import METRE, MICROMETRE, Unit

CHAIN = parse_topology("w C B X b Z Y (C1) t")
ROOT_HALF = 0.7071067811865476


def columns(text: str, context: Context) -> Array:
    basis = parse_effect(text, context.chain).basis(context)
    found: Array = basis.columns  # type: ignore[union-attr]
    return found


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("EYX:const", [[1.0], [1.0], [1.0]]),
        ("EXX:poly1", [[-200.0], [0.0], [50.0]]),
        ("EYX:poly2", [[40000.0], [0.0], [2500.0]]),
        ("EYX:poly3", [[-8e6], [0.0], [125e3]]),
        ("EXX:cyclic400mm", [[-1.0, 0.0], [1.0, 0.0], [ROOT_HALF, ROOT_HALF]]),
        ("EXX:cyclic0.5mm", [[1.0, 0.0], [1.0, 0.0], [1.0, 0.0]]),
        ("EXX:sawtooth80mm(10)", [[-0.125], [0.375], [-0.25]]),
        ("EXX:sawtooth100mm(-50)", [[0.0], [0.0], [-0.5]]),
        ("EXX:step(20)", [[0.5], [-0.5], [-0.5]]),
        ("EXX:step(-10,20)", [[0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]]),
        ("EXX:step100mm(20)", [[0.5], [-0.2], [-0.5]]),
        ("EBB:harmonic1", [[0.0, 1.0], [ROOT_HALF, ROOT_HALF], [-1.0, 0.0]]),
        ("EBB:harmonic2", [[-1.0, 0.0], [0.0, 1.0], [1.0, 0.0]]),
        ("EBB:harmonic3", [[0.0, -1.0], [-ROOT_HALF, ROOT_HALF], [-1.0, 0.0]]),
        ("EAB:poly1", [[np.pi / 2], [np.pi / 4], [np.pi]]),
        ("EXX:table2", [[1.0, 0.0], [0.2, 0.8], [0.0, 1.0]]),
        ("EXX:table6", [[1, 0, 0, 0, 0, 0], [0, 0, 0, 0, 1, 0], [0, 0, 0, 0, 0, 1]]),
        ("EZZ:table3", [[1.0, 0.0, 0.0]] * 3),
        ("EXX:formula(2*x_mm + 1)", [[-399.0], [1.0], [101.0]]),
        ("EXX:formula((x_mm > -10) * b_deg)", [[0.0], [45.0], [180.0]]),
    ],
)
def test_language_of_effects_columns_by_hand(
    make: Callable[..., Context], text: str, expected: list[list[float]]
) -> None:
    context = make(
        {"X": [-200.0, 0.0, 50.0], "B": [np.pi / 2, np.pi / 4, np.pi]},
        columns={"x_mm": [-200.0, 0.0, 50.0], "b_deg": [90.0, 45.0, 180.0]},
    )
    np.testing.assert_allclose(columns(text, context), expected, rtol=1e-12, atol=1e-12)


def test_table_hats_add_to_one_everywhere(make: Callable[..., Context]) -> None:
    context = make({"X": np.linspace(-300.0, 200.0, 101).tolist()})
    hats = columns("EXX:table", context)
    assert hats.shape == (101, shapes.TABLE_NODES)
    np.testing.assert_allclose(hats.sum(axis=1), 1.0, rtol=0, atol=1e-12)
    assert hats.min() >= 0.0


def test_a_move_within_the_repeatability_of_a_touch_reverses_nothing(make: Callable[..., Context]) -> None:
    context = make({"X": [50.0, 50.002, 49.999, 49.995, 49.985, 49.987, 50.1]})
    joint = next(place for place, one in enumerate(context.chain.joints) if one.name == "X")
    # 5 µm back, but 15 µm from where the move ended: creeping does not go unseen.
    np.testing.assert_array_equal(context.travel[:, joint], [1, 1, 1, 1, -1, -1, 1])


def test_a_stop_that_no_plan_asked_for_reverses_nothing(make: Callable[..., Context]) -> None:
    """Touches sent to one position stop up to 40 µm apart; a plan's own steps are 0.3 mm and more."""
    context = make({"X": [50.0, 50.04, 50.0, 49.96, 49.7], "Y": [50.0, 50.04, 50.0, 49.96, 49.7]})
    measured, commanded = (context.chain.index(name) for name in "XY")
    expected = context.positions.copy()
    expected[:, measured] += 1e-4
    moved = context.expecting(expected)
    np.testing.assert_array_equal(moved.travel[:, measured], [1, 1, 1, 1, -1])
    np.testing.assert_array_equal(moved.travel[:, commanded], [1, 1, -1, -1, -1])
    # Balls of a plate whose places the file states: to each the axis was brought.
    stated = replace(moved, stops_are_stated=True)
    np.testing.assert_array_equal(stated.travel[:, measured], [1, 1, -1, -1, -1])


def test_shapes_look_where_the_axis_is_expected(make: Callable[..., Context]) -> None:
    context = make({"X": [10.0, 20.0]}, columns={"x_mm": [10.0, 20.0]})
    joint = next(place for place, one in enumerate(context.chain.joints) if one.name == "X")
    expected = context.positions.copy()
    expected[:, joint] += 0.25
    moved = context.expecting(expected)
    np.testing.assert_array_equal(
        moved.columns["x_mm"], context.chain.joints[joint].sign * expected[:, joint]
    )
    np.testing.assert_array_equal(moved.positions, context.positions)
    for text in ("EXX:poly2", "EXX:cyclic20mm"):
        effect = parse_effect(text, context.chain)
        there = replace(context, positions=expected)
        np.testing.assert_array_equal(effect.basis(moved).columns, effect.basis(there).columns)


def test_reversal_keeps_the_sign_of_the_last_travel(make: Callable[..., Context]) -> None:
    context = make({"X": [5.0, 7.0, 7.0, 6.0, 6.0, 9.0], "Y": [0.0, 0.0, -1.0, -1.0, 0.0, 0.0]})
    assert columns("EXX:reversal", context).ravel().tolist() == [1, 1, 1, -1, -1, 1]
    # Y has not moved before the third probing: no travel, no sign.
    assert columns("EYY:reversal", context).ravel().tolist() == [0, 0, -1, -1, 1, 1]


def test_reversal_begins_afresh_in_every_run(make: Callable[..., Context]) -> None:
    context = make({"X": [-3.0, -9.0, -2.0, -2.0, -5.0, -1.0]}, run=[1, 1, 1, 2, 2, 2])
    # Run 2 begins at -2, reached from the reference point at zero, although run 1 ended at -2 moving up.
    assert columns("EXX:reversal", context).ravel().tolist() == [-1, -1, 1, -1, -1, 1]


def test_reversal_of_runs_that_are_not_side_by_side(make: Callable[..., Context]) -> None:
    context = make({"X": [1.0, -1.0, 3.0, -4.0, 2.0, -2.0]}, run=[1, 2, 1, 2, 1, 2])
    assert columns("EXX:reversal", context).ravel().tolist() == [1, -1, 1, -1, -1, 1]


@pytest.mark.parametrize(
    ("text", "unit", "factor"),
    [
        ("EXX:poly1", "µm/m", 1e-6),
        ("EYX:poly2", "µm/m²", 1e-9),
        ("EYX:poly3", "µm/m³", 1e-12),
        ("EYX:poly4", "µm/m^4", 1e-15),
        ("EAX:poly1", "µrad/m", 1e-9),
        ("EBB:poly1", "µrad/rad", 1e-6),
        ("EBB:harmonic2", "µrad", 1e-6),
        ("EXX:reversal", "µm", 1e-3),
        ("EX0C", "µm", 1e-3),
        ("EA0B", "µrad", 1e-6),
        ("EXX:table", "µm", 1e-3),
        ("EXX:cyclic20mm", "µm", 1e-3),
        ("EAX:sawtooth80mm(0)", "µrad", 1e-6),
        ("EXX:step(120)", "µm", 1e-3),
        ("EXX:poly1@x_axis_degC", "µm/m/K", 1e-6),
        ("EZC1:const@warmup", "µm", 1e-3),
        ("EZC1:const@ambient_hPa", "µm/hPa", 1e-3),
        ("EZC1:const@time_s", "µm/s", 1e-3),
        ("artefact:expansion@ambient_degC", "µm/m/K", 1e-6),
        ("stem:gravity", "µm", 1e-3),
        ("ball:2:moved(run 7, sequence 23)", "µm", 1e-3),
    ],
)
def test_unit_of_the_amplitude(text: str, unit: str, factor: float) -> None:
    effect = parse_effect(text, CHAIN)
    assert effect.unit.name == unit
    assert effect.unit.factor == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("EA0B", ("EA0B",)),
        ("EA0B:const", ("EA0B",)),
        ("EXX:poly1", ("EXX",)),
        ("EXX:poly1@run_time", ("EXX:poly1@run_time",)),
        ("EYX:poly1", ("EYX:poly1",)),
        ("EX0X:poly1", ("EX0X:poly1",)),
        ("EBB:poly1", ("EBB:poly1",)),
        ("EZC1:const@warmup", ("EZC1:const@warmup",)),
        ("EBB:harmonic2", ("EBB:harmonic2.cos", "EBB:harmonic2.sin")),
        ("EXX:table2", ("EXX:table2.node1", "EXX:table2.node2")),
        (
            "EAB:harmonic1@gravity",
            tuple(f"EAB:harmonic1@gravity.{s}.{g}" for s in ("cos", "sin") for g in ("gx", "gy", "gz")),
        ),
    ],
)
def test_names_of_the_coefficients(make: Callable[..., Context], text: str, names: tuple[str, ...]) -> None:
    context = make({"X": [1.0, 2.0]})
    effect = parse_effect(text, CHAIN)
    assert effect.parameters(context) == names
    assert columns(text, context).shape == (2, len(names))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("EXX", "'EXX' is an error motion and needs a shape: write for example EXX:poly1 or EXX:const"),
        ("EXX:poly0", "there is no shape 'poly0'; did you mean 'poly3'? there are const, poly1 to poly9"),
        ("EXX:poly10", "there is no shape 'poly10'"),
        ("EXX:wave", "there is no shape 'wave'"),
        ("EXX:table100", "there is no shape 'table100'"),
        ("EXX:Const", "there is no shape 'Const'"),
        ("EXX:cyclicmm", "there is no shape 'cyclicmm'"),
        ("EXX:cyclic0mm", "the pitch of cyclic0mm must be 0.0001 mm or more; write for example cyclic20mm"),
        (
            "EXX:cyclic-20mm",
            "the pitch of cyclic-20mm must be 0.0001 mm or more; write for example cyclic20mm",
        ),
        ("EXX:cyclic0.00002mm@warmup", "the pitch of cyclic0.00002mm must be 0.0001 mm or more"),
        (
            "EXX:sawtooth0mm(0)",
            "the pitch of sawtooth0mm must be 0.0001 mm or more; write for example sawtooth84mm(",
        ),
        ("EXX:sawtooth-84mm(12)", "the pitch of sawtooth-84mm must be 0.0001 mm or more"),
        (
            "EXX:step0mm(120)",
            "the width of step0mm must be 0.0001 mm or more; write for example step8mm(120)",
        ),
        (
            "EXX:step(300,110)",
            "the places of step(300,110) must be readings in mm in rising order, plain decimals 0.001 mm or more "
            "apart, for example step(110,300)",
        ),
        ("EXX:step()", "the places of step() must be readings in mm in rising order"),
        ("EXX:step(1_20)", "the places of step(1_20) must be readings in mm in rising order"),
        ("EXX:step(1e3)", "the places of step(1e3) must be readings in mm in rising order"),
        ("EXX:step(\uff11\uff12)", "must be readings in mm in rising order, plain decimals"),
        (
            "EXX:step(1,1.00094)",
            "must be readings in mm in rising order, plain decimals 0.001 mm or more apart",
        ),
        ("EXX:step(-1000000)", "the places of step(-1000000) must be between -1000000 and 1000000 mm"),
        ("EXX:step1000000mm(0)", "the width of step1000000mm must be below 1000000 mm"),
        ("EXX:step120mm", "there is no shape 'step120mm'; did you mean 'step(120)'?"),
        ("EBB:step(20)", "a step at a reading in mm belongs to a linear axis; for B write table(...)"),
        (
            "EXX:windup0mm",
            "the width of windup0mm must be above 0 mm; write reversal for what turns over at once",
        ),
        ("EBB:windup-5deg", "the width of windup-5deg must be above 0 deg"),
        ("EXX:table1", "table1 has too few nodes; write table or table2 and above"),
        ("EXX:table0", "table0 has too few nodes"),
        (
            "EBB:harmonic0",
            "the order of harmonic0 must be 1 to 9999 periods a turn; what no turn changes is const",
        ),
        ("EXX:harmonic1", "a harmonic belongs to a rotary axis; for X write cyclic20mm"),
        ("EBB:cyclic20mm", "a cyclic pitch in mm belongs to a linear axis; for B write harmonic1"),
        ("EXX:sawtooth80mm", "there is no shape 'sawtooth80mm'; did you mean 'sawtooth84mm(12)'?"),
        ("EBB:sawtooth80mm(0)", "a sawtooth in mm belongs to a linear axis; for B write harmonics(5,10,15)"),
        ("EXQ:poly1", "'EXQ' is no geometric error of 'w C B X b Z Y (C1) t'"),
        ("", "'' is no geometric error of"),
        ("EXX:poly1@", "'EXX:poly1@' ends in @ without a driver; write for example EXX:poly1@warmup"),
        (
            "EXX:poly1@sunshine",
            "there is no driver '@sunshine'; there are @warmup (or @warmup45min), @settling, @run_time",
        ),
        ("EXX:poly1@warmup0min", "the time constant of @warmup must be above 0 min"),
        ("EXX:poly1@warmup-5min", "there is no driver '@warmup-5min'"),
        ("ball:2:moved", "must say when: write ball:2:moved(run 7, sequence 23)"),
        ("ball:2", "there is no effect 'ball:2' of the artefact"),
        ("stem:wind", "there is no effect 'stem:wind' of the artefact; there are"),
    ],
)
def test_refusals_say_what_would_be_right(text: str, words: str) -> None:
    with pytest.raises(EffectError, match=re.escape(words)):
        parse_effect(text, CHAIN)


def test_a_drive_that_is_wound_up_follows_once_its_width_is_used_up(make: Callable[..., Context]) -> None:
    """A width of 20 mm, 10 mm on each side: out, back by half of it, back by the whole, on, and anew in another run."""
    positions = [0.0, 10.0, 20.0, 15.0, 10.0, 0.0, -10.0, -5.0, 5.0]
    context = make({"X": positions}, run=[1] * 8 + [2])
    expected = [0.0, 1.0, 1.0, 0.5, 0.0, -1.0, -1.0, -0.5, 0.5]
    np.testing.assert_allclose(columns("EXX:windup20mm", context).ravel(), expected, atol=1e-12)
    with pytest.raises(
        EffectError, match=re.escape("a width in mm belongs to a linear axis; for B write windup20deg")
    ):
        parse_effect("EBB:windup20mm", CHAIN)
    with pytest.raises(EffectError, match=re.escape("a width in deg belongs to a rotary axis; for X write")):
        parse_effect("EXX:windup20deg", CHAIN)
    turned = make({"B": np.deg2rad(positions)}, run=[1] * 8 + [2])
    np.testing.assert_allclose(
        np.abs(columns("EBB:windup20deg", turned)).ravel(), np.abs(expected), atol=1e-12
    )


def test_a_refusal_that_needs_the_data(make: Callable[..., Context]) -> None:
    context = make({"X": [1.0, 2.0]}, columns={"x_mm": [1.0, 2.0]})
    with pytest.raises(EffectError, match=r"names 'q_mm', which was not recorded; recorded are x_mm"):
        columns("EXX:formula(q_mm)", context)


@pytest.mark.parametrize(
    "text",
    ["EA0B", "EXX:poly1", "EBB:harmonic2@warmup", "EXX:formula(sin(x_mm) > 0)@run_time", "stem:gravity"],
)
def test_an_effect_writes_itself_as_it_is_read(text: str) -> None:
    assert parse_effect(f"  {text} ", CHAIN).text == text
    assert parse_effect(parse_effect(text, CHAIN).text, CHAIN) == parse_effect(text, CHAIN)


@dataclass(frozen=True)
class Step:
    """A user's shape: 0 below a position, 1 above; its name has a word in it."""

    side: str
    at: str
    pattern: ClassVar[str] = r"step_(?P<side>up|down)(?P<at>-?\d+)mm"
    labels: ClassVar[tuple[str, ...]] = ("",)

    def columns(self, context: Context, joint: int) -> Array:
        above: Array = (context.positions[:, joint, None] > float(self.at)).astype(float)
        return above if self.side == "up" else 1.0 - above

    def unit(self, base: Unit, joint: Joint) -> Unit:
        return base


@dataclass(frozen=True)
class Shift:
    """A user's driver: the shift of the day."""

    name: str
    pattern: ClassVar[str] = r"shift_(?P<name>early|late)"

    def labels(self, context: Context) -> tuple[str, ...]:
        return ("",)

    def columns(self, context: Context, joint: int | None) -> Array:
        late: Array = (context.day_time[:, None] > 3600.0).astype(float)
        return late if self.name == "late" else 1.0 - late

    def unit(self) -> Unit:
        return MICROMETRE.per(METRE)


def test_shape_and_driver_of_the_user_come_through_the_entry_point(
    make: Callable[..., Context], monkeypatch: pytest.MonkeyPatch
) -> None:
    groups: dict[str, tuple[Any, ...]] = {"monitor.shapes": (Step,), "monitor.drivers": (Shift,)}
    monkeypatch.setattr(shapes, "plug_ins", groups.__getitem__)
    monkeypatch.setattr(drivers, "plug_ins", groups.__getitem__)
    context = make({"X": [-20.0, 5.0, 30.0, 40.0]}, day_time=[0.0, 10.0, 20.0, 4000.0])
    assert columns("EXX:step_up10mm", context).ravel().tolist() == [0, 0, 1, 1]
    assert columns("EXX:step_down-5mm", context).ravel().tolist() == [1, 0, 0, 0]
    assert columns("EXX:step_up10mm@shift_late", context).ravel().tolist() == [0, 0, 0, 1]
    assert columns("EXX:const@shift_early", context).ravel().tolist() == [1, 1, 1, 0]
    assert parse_effect("EXX:step_up10mm", CHAIN).parameters(context) == ("EXX:step_up10mm",)
    # What is built in stays as it was.
    assert columns("EXX:poly1", context).ravel().tolist() == [-20, 5, 30, 40]


@dataclass(frozen=True)
class Point:
    """An entry point that gives what a test wants."""

    name: str
    what: object
    value: str = "package:Class"

    def load(self) -> object:
        if isinstance(self.what, Exception):
            raise self.what
        return self.what


class Halfway:
    """A plug-in that was not finished."""

    pattern = r"halfway"


class Unreadable(Step):
    """A plug-in whose pattern is no regular expression."""

    pattern: ClassVar[str] = r"step("


@pytest.mark.parametrize(
    ("what", "message"),
    [
        (
            ImportError("no module named x"),
            r"^the plug-in mine \(package:Class\) cannot be loaded: no module named x$",
        ),
        (
            Halfway,
            r"^the plug-in mine \(package:Class\) lacks labels, columns, unit; docs/effects.md has an example$",
        ),
        (Unreadable, r"^the pattern of the plug-in mine \(package:Class\) is no regular expression: "),
    ],
)
def test_a_broken_plug_in_is_named(monkeypatch: pytest.MonkeyPatch, what: object, message: str) -> None:
    monkeypatch.setattr(registry, "entry_points", lambda *, group: [Point("mine", what)])
    registry.plug_ins.cache_clear()
    try:
        with pytest.raises(EffectError, match=message):
            parse_effect("EXX:anything", CHAIN)
    finally:
        registry.plug_ins.cache_clear()


def test_the_shape_of_the_document_is_what_it_says(
    make: Callable[..., Context], monkeypatch: pytest.MonkeyPatch
) -> None:
    text = (Path(__file__).parents[2] / "docs/effects.md").read_text("utf-8")
    names: dict[str, Any] = {"__name__": "__main__"}
    source = text.split("```python\n# my_shapes.py\n")[1].split("```")[0]
    exec(compile(source, "my_shapes.py", "exec", dont_inherit=True), names)
    monkeypatch.setattr(registry, "entry_points", lambda *, group: [Point("scale_step", names["ScaleStep"])])
    registry.plug_ins.cache_clear()
    try:
        context = make({"X": [-20.0, 119.0, 121.0]})
        assert columns("EXX:scale_step120mm", context).ravel().tolist() == [0, 0, 1]
        with pytest.raises(EffectError, match=r"; from plug-ins scale_step"):
            parse_effect("EXX:scale_stop", CHAIN)
    finally:
        registry.plug_ins.cache_clear()


def test_plug_ins_are_found_by_entry_point_group(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def entry_points(*, group: str) -> list[Point]:
        asked.append(group)
        return [Point("zeta", Shift), Point("alpha", Step)]

    monkeypatch.setattr(registry, "entry_points", entry_points)
    registry.plug_ins.cache_clear()
    try:
        assert registry.plug_ins("monitor.shapes") == (Step, Shift)
        assert registry.plug_ins("monitor.shapes") == (Step, Shift)
        assert asked == ["monitor.shapes"]
    finally:
        registry.plug_ins.cache_clear()


def test_play_of_an_axis_that_turns_is_in_its_bearing() -> None:
    """A table and a head have no carriage that runs in a guide."""
    causes = {text: describe(parse_effect(text, CHAIN)).cause for text in ("EYX:reversal", "EXC:reversal")}
    assert causes == {
        "EYX:reversal": "play in the guide of X lets the carriage shift or tilt when it reverses",
        "EXC:reversal": "play in the bearing of C lets what it carries shift or tilt when it reverses",
    }


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("EYX:poly1", "X is not square to Y"),
        ("EYX:poly2", "the guideway of X is bent"),
        ("EBX:poly1", "the guideway of X is bent"),
        ("EAX:poly1", "the guideway of X is twisted"),
        ("EXX:poly1", "scale or screw of X"),
    ],
    ids=["a slope across", "a curve across", "pitch", "roll", "along"],
)
def test_an_error_motion_of_a_linear_axis_has_the_cause_of_its_kind(text, cause):
    assert describe(parse_effect(text, CHAIN)).cause.startswith(cause)
