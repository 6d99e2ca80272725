"""The store: one DuckDB file with the campaigns, their raw files, and everything that was computed.

``Database(path)`` opens it (a ``with`` statement closes it); the functions here take it as their first
argument. People who query with SQL start from the views ``v_*``; every table and column has a COMMENT with
its unit. Only this room imports duckdb.
"""

from monitor.store.analyses import (
    StoredAnalysis,
    analysis_text,
    check_analysis,
    latest_documents,
    latest_maps,
    load_analysis,
    save_analysis,
    stored_analyses,
)
from monitor.store.archiving import Archived, archive_faults, archive_files, archived_count
from monitor.store.audit import AuditEntry, anchored_entry, chain_faults, last_anchor, last_entries
from monitor.store.campaigns import Imported, import_campaign, import_curve, load_campaign
from monitor.store.catalogue import (
    CampaignRow,
    RunRow,
    WithdrawnCampaign,
    check_machine,
    described_machines,
    list_campaigns,
    list_runs,
    list_withdrawn,
)
from monitor.store.certificates import (
    StoredCertificate,
    certificate_numbers,
    find_certificate,
    list_certificates,
    load_certificate,
    mark_certificate,
    save_certificate,
)
from monitor.store.connection import Database
from monitor.store.copies.backup import take_backup
from monitor.store.copies.compaction import Compaction, compact
from monitor.store.copies.export import export_tables
from monitor.store.copies.increment import take_increment
from monitor.store.copies.manifest import Backup, list_backups
from monitor.store.copies.restoring import Restored, restore
from monitor.store.copies.workbook import export_workbook
from monitor.store.curves import curve_names, is_curve, load_curve
from monitor.store.database_name import check_database_name
from monitor.store.events import NOTE, MachineEvent, StoredEvent, list_events, machine_events, record_event
from monitor.store.identifications import (
    identification_by_number,
    identification_numbers,
    last_identification,
    load_identification,
    save_identification,
)
from monitor.store.import_notes import campaign_notes, run_fingerprints
from monitor.store.machine_models import (
    MachineModel,
    followed_by,
    machine_model,
    machine_models,
    machines_of_method,
    not_identified,
    save_machine_model,
)
from monitor.store.models import (
    StoredModel,
    last_used_campaign,
    list_models,
    load_model,
    model_history,
    next_version,
    save_model,
)
from monitor.store.past.fleet import BlockCut, FleetSums, fleet_sums
from monitor.store.past.history import MachineHistory, latest_tolerances, machine_history, tolerance_types
from monitor.store.past.machine_runs import (
    MachineDescription,
    RecordedRun,
    campaign_machines,
    campaign_tolerances,
    check_campaigns,
    identified_runs,
    latest_frames,
    machine_descriptions,
    machine_runs,
    parameter_frames,
    probing_counts,
)
from monitor.store.recalling import Recalled
from monitor.store.refusals import StoredRefusal, clear_refusals, record_refusal, refusals
from monitor.store.results import StoredIdentification, StoredRun
from monitor.store.selections import (
    SelectionRow,
    StoredSelection,
    find_selection,
    list_selections,
    save_selection,
)
from monitor.store.sharing import SharedDatabase, one_at_a_time
from monitor.store.sql import QueryResult, campaign_readings, column_comments, list_machines, run_query
from monitor.store.turns import Holder, Patience
from monitor.store.type_tolerances import type_in_use
from monitor.store.verification import Verification, verify_audit
from monitor.store.withdrawals import Withdrawal, withdraw_campaign

__all__ = [
    "NOTE",
    "Archived",
    "AuditEntry",
    "Backup",
    "BlockCut",
    "CampaignRow",
    "Compaction",
    "Database",
    "FleetSums",
    "Holder",
    "Imported",
    "MachineDescription",
    "MachineEvent",
    "MachineHistory",
    "MachineModel",
    "Patience",
    "QueryResult",
    "Recalled",
    "RecordedRun",
    "Restored",
    "RunRow",
    "SelectionRow",
    "SharedDatabase",
    "StoredAnalysis",
    "StoredCertificate",
    "StoredEvent",
    "StoredIdentification",
    "StoredModel",
    "StoredRefusal",
    "StoredRun",
    "StoredSelection",
    "Verification",
    "Withdrawal",
    "WithdrawnCampaign",
    "analysis_text",
    "anchored_entry",
    "archive_faults",
    "archive_files",
    "archived_count",
    "campaign_machines",
    "campaign_notes",
    "campaign_readings",
    "campaign_tolerances",
    "certificate_numbers",
    "chain_faults",
    "check_analysis",
    "check_campaigns",
    "check_database_name",
    "check_machine",
    "clear_refusals",
    "column_comments",
    "compact",
    "curve_names",
    "described_machines",
    "export_tables",
    "export_workbook",
    "find_certificate",
    "find_selection",
    "fleet_sums",
    "followed_by",
    "identification_by_number",
    "identification_numbers",
    "identified_runs",
    "import_campaign",
    "import_curve",
    "is_curve",
    "last_anchor",
    "last_entries",
    "last_identification",
    "last_used_campaign",
    "latest_documents",
    "latest_frames",
    "latest_maps",
    "latest_tolerances",
    "list_backups",
    "list_campaigns",
    "list_certificates",
    "list_events",
    "list_machines",
    "list_models",
    "list_runs",
    "list_selections",
    "list_withdrawn",
    "load_analysis",
    "load_campaign",
    "load_certificate",
    "load_curve",
    "load_identification",
    "load_model",
    "machine_descriptions",
    "machine_events",
    "machine_history",
    "machine_model",
    "machine_models",
    "machine_runs",
    "machines_of_method",
    "mark_certificate",
    "model_history",
    "next_version",
    "not_identified",
    "one_at_a_time",
    "parameter_frames",
    "probing_counts",
    "record_event",
    "record_refusal",
    "refusals",
    "restore",
    "run_fingerprints",
    "run_query",
    "save_analysis",
    "save_certificate",
    "save_identification",
    "save_machine_model",
    "save_model",
    "save_selection",
    "stored_analyses",
    "take_backup",
    "take_increment",
    "tolerance_types",
    "type_in_use",
    "verify_audit",
    "withdraw_campaign",
]
