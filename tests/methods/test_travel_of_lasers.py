"""Lasers that read something else than the travel: `identify` refuses, and says which setup and what it reads."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import only_misread
from monitor.exceptions import DataError
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.store import Database, import_campaign
from monitor.workflow.explain.compare import compare
from monitor.workflow.explain.explain import explain
from monitor.workflow.explain.request import CompareRequest, ExplainRequest
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.instruments.instruments import instruments
from monitor.workflow.instruments.request import InstrumentsRequest
from monitor.workflow.predict.predict import predict
from monitor.workflow.predict.request import PredictRequest
from monitor.workflow.uncertainty.evaluation import evaluate
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.volumetric.request import VolumetricRequest
from monitor.workflow.volumetric.volumetric import map_run
from tests.simulator import four_instruments as shop, horizontal_centre as centre


def lasers(folder: Path, change: Callable[[dict], None], setups: str = "laser-Z") -> Campaign:
    """Three axes by a laser, of which some setups were written otherwise."""
    chain = shop.machine(0.0)
    text, rows = shop.laser(chain, np.random.default_rng(3), 1)
    for row in rows:
        if str(row["setup"]).startswith(setups):
            change(row)
    campaign = read_campaign(chain.write(folder / "shop", text, rows))
    assert isinstance(campaign, Campaign)
    return campaign


def scaled(factor: float) -> Callable[[dict], None]:
    return lambda row: row.update(reading_um=factor * row["reading_um"])


def deviations(row: dict) -> None:
    """As many programs write it: the error of the position."""
    row["reading_um"] -= 1e3 * row["Z"]


def of_another_axis(row: dict) -> None:
    row["X"], row["Z"] = row["Z"], row["X"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (scaled(-1.0), "the readings of setup laser-Z are its travel with the other sign"),
        (scaled(1e-3), "the readings of setup laser-Z are its travel in mm: the column is in µm"),
        (scaled(1.0 / 25.4), "the readings of setup laser-Z are its travel in thousandths of an inch"),
        (scaled(0.5), "the readings of setup laser-Z are 0.5 times its travel along `direction`"),
        (deviations, "the readings of setup laser-Z are no travel: the whole travel is read, not its error"),
        (
            of_another_axis,
            "the readings of setup laser-Z are a travel of 400 mm where its tool point moves 0 mm",
        ),
    ],
)
def test_a_laser_that_reads_no_travel_is_named_with_what_it_reads(
    tmp_path: Path, change: Callable[[dict], None], said: str
) -> None:
    campaign = lasers(tmp_path, change)
    with pytest.raises(DataError, match=said) as refused:
        campaign_method(campaign).identify(campaign)
    assert "laser-X" not in str(refused.value)


def test_compare_refuses_in_the_words_of_identify(tmp_path: Path) -> None:
    campaign = lasers(tmp_path, scaled(-1.0))
    with Database(tmp_path / "shop.duckdb") as db:
        import_campaign(db, campaign)
        with pytest.raises(
            DataError, match="the readings of setup laser-Z are its travel with the other sign"
        ) as said:
            compare(db, CompareRequest(campaign.name))
        with pytest.raises(DataError, match="the readings of setup laser-Z are its travel") as identified:
            identify(db, IdentifyRequest(campaign.name))
    assert str(said.value) == str(identified.value)


@pytest.fixture(scope="module")
def turned(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Database, str, str]]:
    """The lasers of which one has the other sign, stored, with what `identify` says of them."""
    folder = tmp_path_factory.mktemp("turned")
    campaign = lasers(folder, scaled(-1.0))
    with Database(folder / "shop.duckdb") as db:
        import_campaign(db, campaign)
        with pytest.raises(DataError, match="setup laser-Z are its travel with the other sign") as said:
            identify(db, IdentifyRequest(campaign.name))
        yield db, campaign.name, str(said.value)


@pytest.mark.parametrize(
    "asked",
    [
        lambda db, name: evaluate(db, UncertaintyRequest(name)),
        lambda db, name: map_run(db, VolumetricRequest(name)),
        lambda db, name: instruments(db, InstrumentsRequest(name)),
        lambda db, name: predict(db, PredictRequest(name)),
        lambda db, name: explain(db, ExplainRequest(name)),
    ],
    ids=["uncertainty", "map", "contributions", "predict", "explain"],
)
def test_every_verb_refuses_in_the_words_of_identify(
    turned: tuple[Database, str, str], asked: Callable[[Database, str], object]
) -> None:
    """`uncertainty`, `map` and certificates said to check signs, topology, targets and units."""
    db, name, words = turned
    with pytest.raises(DataError, match="setup laser-Z are its travel with the other sign") as said:
        asked(db, name)
    assert str(said.value) == words


def test_one_laser_is_misread_only_where_all_others_agree_without_it(tmp_path: Path) -> None:
    """The column of X with the other sign turns the laser too, but the bars and the R-test contradict it as well."""
    rng = np.random.default_rng(9100)
    campaign = read_campaign(centre.campaign(tmp_path / "shop", rng, centre.truth_of(rng)))
    assert isinstance(campaign, Campaign)
    probings, method = campaign.probings, campaign_method(campaign)
    of_laser = probings.channels["setup"] == 1 + [each.id for each in campaign.artefact.setups].index(
        "laser-X"
    )
    reading = np.where(of_laser, -1.0, 1.0) * probings.channels["reading_um"]
    laser = replace(probings, channels={**probings.channels, "reading_um": reading})
    column = replace(probings, readings={**probings.readings, "X": -probings.readings["X"]})
    assert only_misread(campaign, method.problem_of) is None
    assert only_misread(replace(campaign, probings=laser), method.problem_of) == "laser-X"
    assert only_misread(replace(campaign, probings=column), method.problem_of) is None


def test_right_lasers_are_not_named(tmp_path: Path) -> None:
    campaign = lasers(tmp_path, scaled(1.0))
    assert campaign_method(campaign).problem_of(campaign).unsettled == ""


def test_exchanged_labels_of_two_lasers_are_refused_with_what_each_reads(tmp_path: Path) -> None:
    """Beside other instruments the fit settled with both beams turned by a radian, and moved EC0Y by 21 u."""
    rng = np.random.default_rng(9100)
    path = centre.campaign(tmp_path / "shop", rng, centre.truth_of(rng))
    rows = (path / "probings.csv").read_text(encoding="utf-8")
    for old, new in (("laser-X,", "other,"), ("laser-Y,", "laser-X,"), ("other,", "laser-Y,")):
        rows = rows.replace(old, new)
    (path / "probings.csv").write_text(rows, encoding="utf-8")
    campaign = read_campaign(path)
    assert isinstance(campaign, Campaign)
    with pytest.raises(DataError, match=r"laser-X fits only a beam that is turned by .* look at the labels"):
        campaign_method(campaign).identify(campaign)


@pytest.mark.parametrize(
    ("stated", "what"), [(150.0 / 25.4, ": it is in inches"), (15.0, ": it is in cm"), (100.0, "")]
)
def test_a_length_of_a_bar_in_another_unit_is_named(tmp_path: Path, stated: float, what: str) -> None:
    """The circle of the tool points has the radius of the bar, whatever the readings."""
    rng = np.random.default_rng(9100)
    path = centre.campaign(tmp_path / "shop", rng, centre.truth_of(rng), only="bar")
    file = path / "campaign.toml"
    text = file.read_text(encoding="utf-8").replace("length_mm = 150.0", f"length_mm = {stated:.6f}")
    file.write_text(text, encoding="utf-8")
    campaign = read_campaign(path)
    assert isinstance(campaign, Campaign)
    said = f"lie 150 mm from the middle of their circle, and length_mm says {stated:.5g}{what}"
    assert said in campaign_method(campaign).problem_of(campaign).unsettled
