"""Writes the two example campaigns of ``rotary-probing``: ``python -m simulator.tilting_table EXAMPLES`` (from tests/).

Table 4 of Ibaraki, Iritani, Matsushita 2012: eight location errors found in four repeats and once more after four of
them had been compensated. The published numbers are the errors of the simulated machine, so what is identified from the
touches is what is printed; the block stands and is shaped as nobody knows, and is not moved between the runs.
"""

from __future__ import annotations

import json
import shutil
import sys
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np

from .chain import read_topology
from .rotary_probing import Piece, block, paper_plan, touch, write_rotary_campaign

TOPOLOGY = "w C A Y b X Z t"
PLACES = {
    "dx_AY": ("A", 0), "dy_AY": ("A", 1), "dz_AY": ("A", 2), "beta_AY": ("A", 4), "gamma_AY": ("A", 5),
    "dy_CA": ("C", 1), "alpha_AY": ("C", 3), "beta_CA": ("C", 4),
}  # fmt: skip
FIRST = datetime(2012, 3, 5, 9, 0, tzinfo=timezone(timedelta(hours=9)))


def errors(table: dict, column: int | None) -> dict[str, np.ndarray]:
    """The published errors of a repeat (column 0 to 3) or of the one after compensation (None), six an axis."""
    found = {"A": np.zeros(6), "C": np.zeros(6)}
    for symbol, (axis, place) in PLACES.items():
        row = table[symbol]
        value = row["after_comp"] if column is None else row["tests"][column]
        found[axis][place] = value * (1e-3 if row["unit"] == "um" else np.pi / 180e3)
    return found


def main(examples: Path) -> None:
    """Write both folders below ``examples``."""
    references = Path(__file__).resolve().parents[1] / "references/papers/ibaraki2012.json"
    table = json.loads(references.read_text(encoding="utf-8"))["table_4"]
    rng = np.random.default_rng(2012)
    form = {one.target: float(rng.normal(0.0, 0.01)) for one in block()}
    piece = Piece(shift=(0.5, 0.5, -0.3), form=form)
    chain, plan = read_topology(TOPOLOGY), paper_plan()
    for name, columns, start in (
        ("tilting-table", [0, 1, 2, 3], FIRST),
        ("tilting-table-compensated", [None], FIRST + timedelta(hours=4)),
    ):
        folder = examples / name
        shutil.rmtree(folder, ignore_errors=True)
        runs = [touch(chain, plan, errors(table, column), rng, piece=piece) for column in columns]
        write_rotary_campaign(
            folder, name, TOPOLOGY, plan, runs, machine_id="TILT-500", first=start, ambient=[22.4, 22.6, 22.7, 22.9],
            probe_um=0.7,
        )  # fmt: skip


if __name__ == "__main__":
    main(Path(sys.argv[1]))
