"""Virtual campaigns, the steps of the demo, and what it refuses; ``test_readme.py`` runs all of it in ``make slow``."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from monitor.cli.parser import Parser
from monitor.cli.verbs import demo_
from monitor.cli.verbs.demo_ import _quoted

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def beside_the_examples(typed: Any) -> None:
    """The installed package has no examples; they stand where the command is typed."""
    Path("examples").symlink_to(EXAMPLES)


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_simulate_is_reproducible_by_its_seed(typed: Any) -> None:
    for folder, seed in (("a/v", 7), ("b/v", 7), ("c/v", 8)):
        Path(folder).parent.mkdir()
        assert typed("simulate", folder, "--effect", "EXX:reversal", "--seed", seed).status == 0
    assert files(Path("a/v")) == files(Path("b/v"))
    assert files(Path("a/v"))["probings.csv"] != files(Path("c/v"))["probings.csv"]


@pytest.mark.slow
def test_a_virtual_campaign_is_imported_and_its_effect_found(typed: Any, tmp_path: Path) -> None:
    said = typed("simulate", "my rehearsal", "--effect", "EBB:harmonic2", "--peak", 6, "--seed", 7)
    assert said.out == "my rehearsal: 20 runs of 62 probings; EBB:harmonic2 with a peak of 6 µm is hidden\n"
    path = tmp_path / "new.duckdb"
    assert typed("import", "my rehearsal", db=path).status == 0
    assert (
        typed("explain", "my rehearsal", "--json", db=path).document["missing"][0]["effect"]
        == "EBB:harmonic2"
    )


def test_the_demo_prints_paths_with_blanks_as_one_types_them() -> None:
    assert _quoted("out folder/demo.duckdb") == '"out folder/demo.duckdb"'
    assert _quoted("demo-output/demo.duckdb") == "demo-output/demo.duckdb"


@pytest.mark.usefixtures("beside_the_examples")
def test_every_step_of_the_demo_is_a_verb_with_options_that_it_has_on_campaigns_that_are_there(
    typed: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken: list[str] = []

    def parsed(verb: ModuleType, name: str, database: str, arguments: list[str], silent: bool) -> int:
        parser = Parser(prog=name)
        verb.options(parser)
        parser.parse_args(arguments)
        taken.extend([name, *arguments])
        return 0

    monkeypatch.setattr(demo_, "_call", parsed)
    answer = typed("demo", "--out", "out")
    assert answer.status == 0
    assert [line for line in answer.out.splitlines() if line.startswith("$ monitor --db out/demo.duckdb ")]
    campaigns = [part for part in taken if "/" in part and "out" not in part]
    assert len(campaigns) > 2
    assert all(Path(part).exists() for part in campaigns)
    assert {"import", "identify", "stats", "uncertainty", "explain", "model", "certificate", "report"} <= set(
        taken
    )


@pytest.mark.usefixtures("beside_the_examples")
def test_the_demo_into_a_file_is_refused(typed: Any) -> None:
    Path("text").write_text("hello")
    answer = typed("demo", "--out", "text")
    assert (answer.status, answer.out) == (2, "")
    assert "the folder text cannot be used: File exists" in answer.err
