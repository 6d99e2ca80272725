"""Which rows of a database go with which entries of its audit: what is published, and what an incremental backup holds.

The audit names everything that was ever stored, in order. So the rows of some consecutive entries are all that was
stored in that time, and a database without the rows of its last entries is what it was before these.
"""

from __future__ import annotations

from dataclasses import dataclass

import duckdb


@dataclass(frozen=True)
class Source:
    """Which rows of a table an entry of the audit records: those whose ``column`` is the number of its ``subject``."""

    subject: str
    column: str


#: Tables of which an import, and an identification, adds the rows.
_WITH_CAMPAIGN = "imported_campaign source_file run campaign_runs probing curve curve_row"
_WITH_IDENTIFICATION = (
    "identification identified_run identified_values parameter_value parameter_frame lack_of_fit common_part "
    "residual"
)
#: Every table of a plant and what its rows belong to. Those that belong to nothing are published otherwise, below.
SOURCES: dict[str, Source] = {
    **dict.fromkeys(_WITH_CAMPAIGN.split(), Source("campaign", "campaign_id")),
    **dict.fromkeys(_WITH_IDENTIFICATION.split(), Source("identification", "identification_id")),
    "import_note": Source("import notes", "campaign_id"),
    "withdrawn_campaign": Source("withdrawn campaign", "campaign_id"),
    "analysis": Source("analysis", "analysis_id"),
    "event": Source("event", "event_id"),
    "withdrawn_event": Source("withdrawn event", "event_id"),
    "selection": Source("selection", "selection_id"),
    "machine_model": Source("machine model", "choice_id"),
    "refused_import": Source("refused import", "refusal_id"),
    "refusal_cleared": Source("cleared refusal", "refusal_id"),
    "certificate": Source("certificate", "entry"),
    "audit": Source("entry", "entry"),
}
#: Tables with rows that no entry names (``run_fingerprint`` may come later than its campaign), or of the schema itself.
OTHERWISE = ("model", "registered_machine", "run_fingerprint", "schema_migration")

#: The rows that the entries from first to last of a plant's audit record.
_PORTION = """
CREATE OR REPLACE TEMP TABLE portion AS
WITH entries AS (
    SELECT entry, subject, key, row_number() OVER (PARTITION BY subject, key ORDER BY entry) AS nth FROM {catalog}.audit
), campaigns AS (
    SELECT campaign_id, campaign, row_number() OVER (PARTITION BY campaign ORDER BY campaign_id) AS nth
    FROM {catalog}.imported_campaign
), next AS (SELECT * FROM entries WHERE entry BETWEEN $first AND $last)
SELECT 'campaign' AS subject, key, campaign_id AS number
FROM next JOIN campaigns ON campaign = key AND campaigns.nth = next.nth WHERE subject = 'campaign'
UNION ALL SELECT subject, key, NULL FROM next WHERE subject = 'model'
UNION ALL SELECT subject, key, CAST(regexp_extract(key, ' entry ([0-9]+)$', 1) AS INTEGER)
FROM next WHERE subject = 'certificate'
UNION ALL SELECT subject, key, CAST(key AS INTEGER) FROM next WHERE subject NOT IN ('campaign', 'model', 'certificate')
UNION ALL SELECT 'entry', '', entry FROM next
"""


def select_portion(connection: duckdb.DuckDBPyConnection, catalog: str, first: int, last: int) -> None:
    """Make the temporary table ``portion`` of what the entries from first to last of a catalog's audit record."""
    connection.execute(_PORTION.format(catalog=catalog), {"first": first, "last": last})


def rows_recorded(connection: duckdb.DuckDBPyConnection) -> dict[str, str]:
    """Return by table the condition, on the table as ``t``, of the rows that the entries of ``portion`` record."""
    spans = {
        subject: (low, high)
        for subject, low, high in connection.execute(
            "SELECT subject, min(number), max(number) FROM portion GROUP BY subject"
        ).fetchall()
    }
    conditions = {}
    for table, source in SOURCES.items():
        if source.subject in spans:
            low, high = spans[source.subject]
            # The span lets blocks of other numbers be left out unread.
            conditions[table] = (
                f"t.{source.column} BETWEEN {low} AND {high} AND t.{source.column} IN "
                f"(SELECT number FROM portion WHERE subject = '{source.subject}')"
            )
    if "model" in spans:
        conditions["model"] = (
            "t.model || ' version ' || t.version IN (SELECT key FROM portion WHERE subject = 'model')"
        )
    return conditions
