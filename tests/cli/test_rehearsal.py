"""Virtual campaigns, and what the demo refuses; that it does the main job is tested with the README, which runs it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

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
def test_the_demo_into_a_file_is_refused(typed: Any) -> None:
    Path("text").write_text("hello")
    answer = typed("demo", "--out", "text")
    assert (answer.status, answer.out) == (2, "")
    assert "the folder text cannot be used: File exists" in answer.err
