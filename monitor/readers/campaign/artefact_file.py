"""The probe and the artefact of ``campaign.toml``."""

from __future__ import annotations

from monitor.readers.axes import FARTHEST_MM
from monitor.readers.campaign.l_shape_file import read_l_shape
from monitor.readers.campaign.self_calibration_file import read_self_calibration
from monitor.readers.faults import one_of, quoted
from monitor.readers.setups.agreement import SCALE, check_one_statement
from monitor.readers.setups.known_key import read_known
from monitor.readers.setups.scale_key import read_scale_uncertainty
from monitor.readers.toml_table import Table
from monitor.records import Artefact, Ball, Probe, Reflector, ScaleBar
from monitor.units import MICROMETRE

POINT = "[118.0, 6.0, 178.8]"
#: An expansion coefficient beyond this is a slip of unit: plastics reach 2e-4 1/K, steel has 1.15e-5 1/K.
LARGEST_EXPANSION_PER_K = 1e-3
#: A reference temperature beyond this is a slip of unit; ISO 1 has 20 °C.
LARGEST_REFERENCE_DEGC = 200.0


def read_probe(top: Table, *, required: bool = True, has_scale: bool = False) -> Probe | None:
    """Read the ``[probe]`` table; one that measures from outside has a scale (``has_scale``)."""
    table = top.table("probe", required=required)
    if table is None:
        return None
    identity = table.text("id", required=True, example='"probe-1"')
    model = table.text("model", required=True, example='"touch-trigger probe"')
    uncertainty = table.number(
        "standard_uncertainty_um",
        required=True,
        positive=True,
        largest=MICROMETRE.to_display(FARTHEST_MM),
        unit="um",
        example="0.7",
    )
    tip = table.numbers("tip_mm", 3, largest=FARTHEST_MM, unit="mm", example="[0.0, 0.0, -150.0]")
    certificate = table.text("certificate")
    scale = read_scale_uncertainty(table) if has_scale else None
    stated = read_known(table, (SCALE.name,)) if has_scale else ()
    check_one_statement(table, stated)
    table.finish()
    if identity is None or model is None or uncertainty is None:
        return None
    point = None if tip is None else (tip[0], tip[1], tip[2])
    return Probe(identity, model, MICROMETRE.to_internal(uncertainty), point, certificate, scale, stated)


def read_artefact(top: Table) -> tuple[Artefact | None, list[str] | None]:
    """Read the ``[artefact]`` table and the ids of its balls; without one, an artefact of no balls.

    The artefact is None if anything in it is wrong, the ids are None if anything of a ball is.
    """
    table = top.table("artefact")
    if table is None:
        return Artefact("", ()), []
    before = len(table.faults)
    identity = table.text("id")
    balls: dict[str, Ball] = {}
    for row in table.tables("balls"):
        ball = _ball(row)
        if ball is not None and ball.id in balls:
            row.fault("id", f"ball {quoted(ball.id)} is listed twice; give every ball its own id")
        elif ball is not None:
            balls[ball.id] = ball
    ids = None if len(table.faults) > before else list(balls)
    reflectors = _reflectors(table)
    bar = _scale_bar(table, ids)
    if bar is not None and ids is not None:
        _refuse_one_place(table, *(balls[name] for name in bar.balls))
    piece = read_l_shape(table)
    calibration = read_self_calibration(table)
    table.finish()
    if len(table.faults) > before:
        return None, ids
    return Artefact(identity or "", tuple(balls.values()), bar, reflectors, piece, calibration), ids


def _reflectors(artefact: Table) -> tuple[Reflector, ...]:
    reflectors: dict[str, Reflector] = {}
    for row in artefact.tables("reflectors"):
        identity = row.text("id", required=True, example='"R1"')
        fixed = row.raw("fixed", required=False, example="true")
        if fixed is not None and not isinstance(fixed, bool):
            row.fault(
                "fixed", f"{quoted(fixed)} is neither true (beside the machine) nor false (on the tool)"
            )
        row.finish()
        if identity is not None and identity in reflectors:
            row.fault("id", f"reflector {quoted(identity)} is listed twice; give every reflector its own id")
        elif identity is not None:
            reflectors[identity] = Reflector(identity, fixed is True)
    return tuple(reflectors.values())


def _ball(table: Table) -> Ball | None:
    identity = table.text("id", required=True, example='"1"')
    nominal = table.numbers("nominal_mm", 3, required=True, largest=FARTHEST_MM, unit="mm", example=POINT)
    diameter = table.number(
        "diameter_mm", required=True, positive=True, largest=FARTHEST_MM, unit="mm", example="19.05"
    )
    table.finish()
    if identity is None or nominal is None or diameter is None:
        return None
    return Ball(identity, (nominal[0], nominal[1], nominal[2]), diameter)


def _scale_bar(artefact: Table, balls: list[str] | None) -> ScaleBar | None:
    table = artefact.table("scale_bar")
    if table is None:
        return None
    ends = _ends(table, balls)
    length = table.number(
        "length_mm", required=True, positive=True, largest=FARTHEST_MM, unit="mm", example="304.98923"
    )
    uncertainty = table.number(
        "standard_uncertainty_mm",
        required=True,
        positive=True,
        largest=FARTHEST_MM,
        unit="mm",
        example="0.0012",
    )
    certificate = table.text("certificate", required=True, example='"bar certificate 2016-04"')
    expansion = table.number(
        "expansion_coefficient_per_K", largest=LARGEST_EXPANSION_PER_K, unit="1/K", example="11.5e-6"
    )
    reference = table.number(
        "reference_temperature_degC", largest=LARGEST_REFERENCE_DEGC, unit="degC", example="20.0"
    )
    table.finish()
    if ends is None or length is None or uncertainty is None or certificate is None:
        return None
    return ScaleBar(ends, length, uncertainty, certificate, expansion, reference)


def _refuse_one_place(artefact: Table, first: Ball, second: Ball) -> None:
    """Make a fault of two ends of the bar at one place: the bar would have no direction to begin with."""
    if first.nominal == second.nominal:
        artefact.fault(
            "scale_bar",
            f"its balls {quoted(first.id)} and {quoted(second.id)} have the same nominal_mm, "
            f"{list(first.nominal)}; correct one of the two places",
        )


def _ends(table: Table, balls: list[str] | None) -> tuple[str, str] | None:
    example = '["S1", "S2"]'
    value = table.raw("balls", required=True, example=example)
    if value is None:
        return None
    if not isinstance(value, list) or len(value) != 2 or not all(isinstance(end, str) for end in value):
        table.fault("balls", f"{quoted(value)} is not two ball ids; write for example balls = {example}")
        return None
    if value[0] == value[1]:
        table.fault("balls", f"both ends are {quoted(value[0])}; a bar has two balls, such as {example}")
        return None
    unknown = [end for end in value if balls is not None and end not in balls]
    for end in unknown:
        table.fault("balls", f"there is no ball {quoted(end)}; the balls are {one_of(balls or ())}")
    return None if unknown else (value[0], value[1])
