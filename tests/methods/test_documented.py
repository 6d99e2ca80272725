"""The documents say of every method what the registry says: their tables are made of it.

``python tests/methods/test_documented.py`` prints the tables to paste into README.md and docs/methods.md.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import pytest

from monitor.methods import Able, AnglePlan, InstrumentPlan, Method, TouchPlan, Unable, methods

CHECKOUT = Path(__file__).resolve().parents[2]
README, DOCUMENT = CHECKOUT / "README.md", CHECKOUT / "docs" / "methods.md"
IN_CHECKOUT = pytest.mark.skipif(not DOCUMENT.exists(), reason="the documents stay in the checkout")
Ability = Able | Unable
# What a user types, and the field of a method that says whether there is an answer; None: every method has one.
VERBS: tuple[tuple[str, Callable[[Method], Ability] | None], ...] = (
    ("`identify`, `compare`, `explain`, `model`, `effects`", None),
    ("`identify --stepwise`", lambda method: method.stepwise),
    ("`stats`, parameters", lambda method: method.statistics),
    ("`stats`, probed coordinates", lambda method: method.coordinates),
    ("`uncertainty`", lambda method: method.uncertainty),
    ("`plan`", lambda method: method.plan),
    ("`map`", lambda method: method.map),
    ("`trend`", lambda method: method.trend),
    ("`certificate`", lambda method: method.certificate),
    ("`simulate`", lambda method: method.rehearsal),
    ("`contributions`", lambda method: method.instruments),
    ("`standards`", lambda method: method.standards),
)


def cell(ability: Ability) -> str:
    """A method's answer to a verb in a table."""
    if isinstance(ability, Unable):
        return "-"
    words = {
        TouchPlan: "balls, indexations",
        AnglePlan: "angles of the table",
        InstrumentPlan: "tests of instruments",
    }
    return words.get(type(ability), "yes")


def method_table() -> list[str]:
    """The methods, and what their targets and rows are called."""
    rows = ["| method | title | target | row |", "| --- | --- | --- | --- |"]
    return rows + [
        f"| `{name}` | {method.title} | {method.nouns.target} | {method.nouns.row} |"
        for name, method in methods().items()
    ]


def verb_table() -> list[str]:
    """Method x verb, a verb a row."""
    rows = [
        f"| verb | {' | '.join(f'`{name}`' for name in methods())} |",
        f"| --- |{' --- |' * len(methods())}",
    ]
    for verb, ability_of in VERBS:
        cells = [cell(Able() if ability_of is None else ability_of(method)) for method in methods().values()]
        rows.append(f"| {verb} | {' | '.join(cells)} |")
    return rows


def reason_table() -> list[str]:
    """Why a method has no answer to a verb."""
    rows = ["| method | verb | why not |", "| --- | --- | --- |"]
    for name, method in methods().items():
        reasons: dict[str, list[str]] = {}
        for verb, ability_of in VERBS:
            ability = Able() if ability_of is None else ability_of(method)
            if isinstance(ability, Unable):
                reasons.setdefault(ability.why, []).append(verb)
        rows += [f"| `{name}` | {'; '.join(verbs)} | {why} |" for why, verbs in reasons.items()]
    return rows


def method_row(method: Method) -> str:
    """A method in the table of the README: linked to its document where it has one, with its smallest example."""
    name = f"`{method.name}`"
    if (CHECKOUT / "docs" / f"{method.name}.md").exists():
        name = f"[{name}](docs/{method.name}.md)"
    return f"| {name} | {method.description} |"


@IN_CHECKOUT
@pytest.mark.parametrize("table", [method_table, verb_table, reason_table])
def test_what_a_method_can_do_is_documented_as_it_is_registered(table: Callable[[], list[str]]) -> None:
    assert "\n".join(table()) in DOCUMENT.read_text(encoding="utf-8")


def test_every_ability_stands_in_the_table() -> None:
    abilities = [field.name for field in fields(Method) if str(field.type).count("Unable")]
    documented = {ability_of.__code__.co_names[0] for _, ability_of in VERBS if ability_of is not None}
    assert sorted(documented) == sorted(abilities)


@IN_CHECKOUT
@pytest.mark.parametrize("name", methods())
def test_the_readme_lists_every_method_with_an_example_of_it(name: str) -> None:
    start = method_row(methods()[name]).removesuffix("|")
    (row,) = [line for line in README.read_text(encoding="utf-8").splitlines() if line.startswith(start)]
    example = row.removeprefix(start).strip("| `")
    toml = tomllib.loads((CHECKOUT / example / "campaign.toml").read_text(encoding="utf-8"))
    assert toml["method"] == name


if __name__ == "__main__":
    print("\n".join(["README.md", *map(method_row, methods().values()), "", "docs/methods.md", ""]))
    print("\n".join([*method_table(), "", *verb_table(), "", *reason_table()]))
