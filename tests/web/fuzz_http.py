"""Asks the whole HTTP interface what nobody would think of, by schemathesis: no answer may be a server error.

``make fuzz-http``. A server of its own has campaigns, a certificate and models; the schema is that of the server with
the names that there are put beside the random ones, so that questions get beyond "there is no campaign". Besides server
errors an answer may not have a status, a content type or fields that the schema does not describe. Prints how many
were asked and ends with status 1 where anything was wrong.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
CAMPAIGNS = ("hidden-spindle-growth", "load-cell", "nothing-hidden")
#: Names that there are, by the field that takes them.
NAMES: dict[str, list[Any]] = {
    "campaign": list(CAMPAIGNS),
    "of": list(CAMPAIGNS),
    "like": list(CAMPAIGNS),
    "machine": ["HU40-T"],
    "model": ["samba", "curve", "samba@1"],
    "to": ["samba", "curve"],
    "effect": ["EXX:reversal", "EZC1:const@warmup", "load_N:poly2"],
    "parameter": ["EB0C", "EXX"],
    "number": ["2026-0001"],
    "run": [1, 20],
    "by": ["day", "run"],
    "method": ["guf"],
    "week": ["2026-W10"],
    "format": ["csv", "parquet", "xlsx"],
    "query": ["SELECT * FROM v_runs", "FROM v_parameters"],
    "tables": [["v_runs"]],
    "start": ["2026-01-12"],
    "topology": ["w C B X b Z Y (C1) t"],
}
CHECKS = "not_a_server_error,status_code_conformance,content_type_conformance,response_schema_conformance"


def started(database: Path) -> tuple[subprocess.Popen[str], str]:
    """A server of a database with something of everything, and its address."""
    monitor = [sys.executable, "-m", "monitor", "--db", str(database)]
    subprocess.run(
        [*monitor, "import", *(EXAMPLES / name for name in CAMPAIGNS)], check=True, capture_output=True
    )
    subprocess.run([*monitor, "identify"], check=True, capture_output=True)
    issue = ["certificate", "issue", "nothing-hidden", "--run", "20", "--number", "2026-0001"]
    laboratory = [
        "--laboratory",
        str(EXAMPLES / "laboratory.toml"),
        "--out",
        str(database.parent / "one.pdf"),
    ]
    subprocess.run([*monitor, *issue, *laboratory], check=True, capture_output=True)
    server = subprocess.Popen(
        [*monitor, "serve", "--port", "0"], stdout=subprocess.PIPE, stderr=sys.stderr, text=True
    )
    assert server.stdout is not None
    return server, server.stdout.readline().split(" at ")[1].split("/ ;")[0]


def with_names(schema: Any) -> Any:
    """The schema with the names that there are beside whatever else a field takes."""
    if isinstance(schema, list):
        return [with_names(part) for part in schema]
    if not isinstance(schema, dict):
        return schema
    changed = {key: with_names(part) for key, part in schema.items()}
    properties = changed.get("properties")
    if isinstance(properties, dict):
        for name, names in NAMES.items():
            if name in properties and isinstance(properties[name], dict):
                properties[name] = {"anyOf": [{"enum": names}, {"enum": names}, properties[name]]}
    return changed


def main() -> int:
    """Ask; the exit status is that of schemathesis, 1 where the server logged a fault."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--examples", type=int, default=60, help="of every question (default 60)")
    parser.add_argument("--seed", type=int, default=17)
    parser.add_argument("--seconds", type=int, default=1200, help="how long (default 1200)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="monitor-fuzz-") as folder:
        server, address = started(Path(folder, "monitor.duckdb"))
        try:
            with urllib.request.urlopen(f"{address}/api/v1/openapi.json") as answer:
                schema = json.load(answer)
            for address_of_question, path in schema["paths"].items():
                if "withdraw" in address_of_question:
                    continue  # what is withdrawn is not there for the other questions
                for content in path["post"]["requestBody"]["content"].values():
                    content["schema"] = with_names(content["schema"])
            described = Path(folder, "openapi.json")
            described.write_text(json.dumps(schema))
            begin = time.monotonic()
            command = [
                str(Path(sys.executable).parent / "schemathesis"), "run", str(described), "--url", address,
                "--checks", CHECKS, "--max-examples", str(options.examples), "--seed", str(options.seed),
                "--phases", "coverage,fuzzing", "--request-timeout", "120", "--suppress-health-check", "all",
                "--max-time", str(options.seconds), "--no-shrink", "--continue-on-failure",
            ]  # fmt: skip
            status = subprocess.run(command, cwd=folder, check=False).returncode
            print(f"{len(schema['paths'])} questions, seed {options.seed}, {time.monotonic() - begin:.0f} s")
            print("the server still runs" if server.poll() is None else "THE SERVER ENDED")
            return status or int(server.poll() is not None)
        finally:
            server.terminate()
            server.wait()


if __name__ == "__main__":
    sys.exit(main())
