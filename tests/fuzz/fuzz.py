"""Coverage-guided fuzzing (atheris) of what reads other people's text: an input is taken or refused in words.

``python tests/fuzz/fuzz.py --seconds 60`` runs every target that long, each in a process of its own, begins from what
``examples`` and the documentation hold, and ends with status 1 where an input raised anything but a ``MonitorError``;
such an input is kept in ``fuzz-output/`` and belongs into a test.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[2]
FINDINGS = CHECKOUT / "fuzz-output"
TOPOLOGY = "w C B X b Z Y (C1) t"


def effects() -> Callable[[bytes], object]:
    from monitor.effects.effect import parse_effect
    from monitor.machine import parse_topology

    chain = parse_topology(TOPOLOGY)
    return lambda content: parse_effect(content.decode(errors="replace"), chain)


def curves() -> Callable[[bytes], object]:
    from monitor.effects.curve.language import parse_curve_effect

    return lambda content: parse_curve_effect(content.decode(errors="replace"))


def topologies() -> Callable[[bytes], object]:
    from monitor.machine import parse_topology

    return lambda content: parse_topology(content.decode(errors="replace"))


def conditions() -> Callable[[bytes], object]:
    """Conditions on the runs of a campaign, as `select --where` takes them."""
    from monitor.readers import read_campaign
    from monitor.workflow.run_statistics.columns import campaign_columns, selected

    campaign = read_campaign(CHECKOUT / "examples" / "five-days")
    columns = campaign_columns(campaign)
    return lambda content: selected(columns, content.decode(errors="replace"), len(campaign.runs))


def campaigns() -> Callable[[bytes], object]:
    """The three files of a campaign, with a zero byte between them."""
    from monitor.readers import read_campaign

    folder = Path(tempfile.mkdtemp(prefix="fuzz-", dir="/dev/shm" if Path("/dev/shm").is_dir() else None))

    def read(content: bytes) -> object:
        for name, part in zip(
            ("campaign.toml", "runs.csv", "probings.csv"), content.split(b"\0", 2), strict=False
        ):
            (folder / name).write_bytes(part)
        return read_campaign(folder)

    return read


def exports() -> Callable[[bytes], object]:
    """A file of an instrument and its mapping: the first byte says which sample's place it takes."""
    import shutil

    from monitor.readers import read_campaign

    samples = _samples()
    room = Path(tempfile.mkdtemp(prefix="fuzz-", dir="/dev/shm" if Path("/dev/shm").is_dir() else None))
    for folder in {path.parent for path in samples}:
        shutil.copytree(folder, room / folder.name)

    def read(content: bytes) -> object:
        sample = samples[content[0] % len(samples) if content else 0]
        spoilt = room / sample.parent.name / sample.name
        spoilt.write_bytes(content[1:])
        try:
            return read_campaign(spoilt.parent)
        finally:
            shutil.copyfile(sample, spoilt)

    return read


def _samples() -> list[Path]:
    folders = [CHECKOUT / "examples" / name for name in ("files-as-they-come", "files-of-a-plate")]
    return [path for folder in folders for path in sorted(folder.iterdir()) if path.name != "README.md"]


def requests() -> Callable[[bytes], object]:
    """A question and the JSON of its request, as they come over HTTP."""
    from monitor.exceptions import InputError
    from monitor.web.asking import request_of
    from monitor.workflow.contract import QUESTIONS

    names = sorted(QUESTIONS)

    def ask(content: bytes) -> object:
        if not content:
            raise InputError("nothing")
        try:
            document = json.loads(content[1:])
        except (ValueError, RecursionError) as error:
            raise InputError("no JSON") from error
        if not isinstance(document, dict):
            raise InputError("no document")
        return request_of(names[content[0] % len(names)], document, {})

    return ask


TARGETS = {
    "effects": effects,
    "curves": curves,
    "topologies": topologies,
    "conditions": conditions,
    "campaigns": campaigns,
    "exports": exports,
    "requests": requests,
}


def seeds(target: str) -> Iterator[bytes]:
    """What the fuzzer begins from."""
    texts = [path.read_text("utf-8") for path in [*CHECKOUT.glob("docs/*.md"), CHECKOUT / "README.md"]]
    if target == "campaigns":
        for folder in sorted((CHECKOUT / "examples").iterdir()):
            files = [folder / name for name in ("campaign.toml", "runs.csv", "probings.csv")]
            if all(file.is_file() for file in files):
                toml, runs, probings = (file.read_bytes() for file in files)
                # A few rows: what counts is the form.
                yield b"\0".join(
                    (toml, b"\n".join(runs.splitlines()[:4]), b"\n".join(probings.splitlines()[:9]))
                )
    elif target == "exports":
        for number, path in enumerate(_samples()):
            yield bytes([number]) + path.read_bytes()
    elif target == "requests":
        from monitor.web.asking import taken_fields
        from monitor.workflow.contract import QUESTIONS

        for number, question in enumerate(sorted(QUESTIONS)):
            for value in ("x", 1, -0.5, None, [], ["2026-01-01"], {"a": True}):
                yield bytes([number]) + json.dumps(dict.fromkeys(taken_fields(question), value)).encode()
    elif target == "topologies":
        yield from (
            text.encode() for text in (TOPOLOGY, "w X Y b Z t", "w b A1 A2 A3 A4 A5 A6 t", "w X b Y t")
        )
    else:
        for text in texts:
            yield from (code.encode() for code in re.findall(r"`([^`\n]{2,80})`", text))


def fuzz(target: str, seconds: int) -> None:
    """Run a target in this process; libFuzzer ends it."""
    import atheris

    with atheris.instrument_imports(include=["monitor"], enable_loader_override=False):
        take = TARGETS[target]()
        from monitor.exceptions import MonitorError

    def one_input(content: bytes) -> None:
        try:
            take(content)
        except MonitorError as refusal:
            said = str(refusal).strip()
        else:
            said = "taken"
        if not said:
            raise AssertionError("a refusal without words")

    with tempfile.TemporaryDirectory() as corpus:
        for number, content in enumerate(seeds(target)):
            (Path(corpus) / f"{number:05d}").write_bytes(content)
        FINDINGS.mkdir(exist_ok=True)
        atheris.Setup(
            ["fuzz", corpus, f"-max_total_time={seconds}", "-max_len=20000", "-timeout=30", "-rss_limit_mb=1500",
             f"-artifact_prefix={FINDINGS}/{target}-", "-print_final_stats=1", "-verbosity=0", "-seed=1"],
            one_input,
        )  # fmt: skip
        atheris.Fuzz()


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seconds", type=int, default=600)
    options.add_argument("--target", choices=sorted(TARGETS))
    options.add_argument("--alone", action="store_true", help=argparse.SUPPRESS)
    chosen = options.parse_args()
    if chosen.alone:
        fuzz(chosen.target, chosen.seconds)
        return 0
    total, broken = 0, []
    for target in [chosen.target] if chosen.target else TARGETS:
        command = [
            sys.executable, __file__, "--alone", "--target", target, "--seconds", str(chosen.seconds),
        ]  # fmt: skip
        ended = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
        said = ended.stdout + ended.stderr
        executed = re.search(r"number_of_executed_units: *(\d+)", said)
        count = int(executed[1]) if executed else 0
        total += count
        print(f"{target:<12} {count:>10} inputs{'' if ended.returncode == 0 else ', BROKEN'}", flush=True)
        if ended.returncode:
            broken.append(target)
            print(said[-3000:])
    print(f"{total} inputs, {len(broken)} of the targets broken")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
