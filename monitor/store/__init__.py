"""The store: one DuckDB file with the campaigns, their raw files, and everything that was computed.

``Database(path)`` opens it (a ``with`` statement closes it); the functions here take it as their first
argument. People who query with SQL start from the views ``v_*``; every table and column has a COMMENT with
its unit. Only this room imports duckdb.
"""

from typing import TYPE_CHECKING

from monitor.on_demand import on_demand
from monitor.store.machine_models import (
    MachineModel as MachineModel,
)
from monitor.store.machine_models import (
    followed_by as followed_by,
)
from monitor.store.machine_models import (
    machine_model as machine_model,
)
from monitor.store.machine_models import (
    machine_models as machine_models,
)
from monitor.store.machine_models import (
    machines_of_method as machines_of_method,
)
from monitor.store.machine_models import (
    not_identified as not_identified,
)
from monitor.store.machine_models import (
    save_machine_model as save_machine_model,
)
from monitor.store.refusals import (
    StoredRefusal as StoredRefusal,
)
from monitor.store.refusals import (
    clear_refusals as clear_refusals,
)
from monitor.store.refusals import (
    record_refusal as record_refusal,
)
from monitor.store.refusals import (
    refusals as refusals,
)

if TYPE_CHECKING:
    from monitor.store.analyses import (
        StoredAnalysis as StoredAnalysis,
    )
    from monitor.store.analyses import (
        analysis_text as analysis_text,
    )
    from monitor.store.analyses import (
        check_analysis as check_analysis,
    )
    from monitor.store.analyses import (
        latest_documents as latest_documents,
    )
    from monitor.store.analyses import (
        latest_maps as latest_maps,
    )
    from monitor.store.analyses import (
        load_analysis as load_analysis,
    )
    from monitor.store.analyses import (
        save_analysis as save_analysis,
    )
    from monitor.store.analyses import (
        stored_analyses as stored_analyses,
    )
    from monitor.store.archiving import (
        Archived as Archived,
    )
    from monitor.store.archiving import (
        archive_faults as archive_faults,
    )
    from monitor.store.archiving import (
        archive_files as archive_files,
    )
    from monitor.store.archiving import (
        archived_count as archived_count,
    )
    from monitor.store.audit import (
        AuditEntry as AuditEntry,
    )
    from monitor.store.audit import (
        anchored_entry as anchored_entry,
    )
    from monitor.store.audit import (
        chain_faults as chain_faults,
    )
    from monitor.store.audit import (
        last_anchor as last_anchor,
    )
    from monitor.store.audit import (
        last_entries as last_entries,
    )
    from monitor.store.campaigns import (
        Imported as Imported,
    )
    from monitor.store.campaigns import (
        import_campaign as import_campaign,
    )
    from monitor.store.campaigns import (
        import_curve as import_curve,
    )
    from monitor.store.campaigns import (
        load_campaign as load_campaign,
    )
    from monitor.store.catalogue import (
        CampaignRow as CampaignRow,
    )
    from monitor.store.catalogue import (
        RunRow as RunRow,
    )
    from monitor.store.catalogue import (
        WithdrawnCampaign as WithdrawnCampaign,
    )
    from monitor.store.catalogue import (
        check_machine as check_machine,
    )
    from monitor.store.catalogue import (
        described_machines as described_machines,
    )
    from monitor.store.catalogue import (
        list_campaigns as list_campaigns,
    )
    from monitor.store.catalogue import (
        list_runs as list_runs,
    )
    from monitor.store.catalogue import (
        list_withdrawn as list_withdrawn,
    )
    from monitor.store.certificates import (
        StoredCertificate as StoredCertificate,
    )
    from monitor.store.certificates import (
        certificate_numbers as certificate_numbers,
    )
    from monitor.store.certificates import (
        find_certificate as find_certificate,
    )
    from monitor.store.certificates import (
        list_certificates as list_certificates,
    )
    from monitor.store.certificates import (
        load_certificate as load_certificate,
    )
    from monitor.store.certificates import (
        mark_certificate as mark_certificate,
    )
    from monitor.store.certificates import (
        save_certificate as save_certificate,
    )
    from monitor.store.connection import Database as Database
    from monitor.store.copies.backup import (
        snapshot as snapshot,
    )
    from monitor.store.copies.backup import (
        take_backup as take_backup,
    )
    from monitor.store.copies.compaction import (
        Compaction as Compaction,
    )
    from monitor.store.copies.compaction import (
        compact as compact,
    )
    from monitor.store.copies.export import export_tables as export_tables
    from monitor.store.copies.increment import take_increment as take_increment
    from monitor.store.copies.manifest import (
        Backup as Backup,
    )
    from monitor.store.copies.manifest import (
        list_backups as list_backups,
    )
    from monitor.store.copies.restoring import (
        Restored as Restored,
    )
    from monitor.store.copies.restoring import (
        restore as restore,
    )
    from monitor.store.copies.workbook import export_workbook as export_workbook
    from monitor.store.curves import (
        curve_names as curve_names,
    )
    from monitor.store.curves import (
        is_curve as is_curve,
    )
    from monitor.store.curves import (
        load_curve as load_curve,
    )
    from monitor.store.database_name import check_database_name as check_database_name
    from monitor.store.events import (
        NOTE as NOTE,
    )
    from monitor.store.events import (
        MachineEvent as MachineEvent,
    )
    from monitor.store.events import (
        StoredEvent as StoredEvent,
    )
    from monitor.store.events import (
        list_events as list_events,
    )
    from monitor.store.events import (
        machine_events as machine_events,
    )
    from monitor.store.events import (
        record_event as record_event,
    )
    from monitor.store.identifications import (
        identification_by_number as identification_by_number,
    )
    from monitor.store.identifications import (
        identification_numbers as identification_numbers,
    )
    from monitor.store.identifications import (
        last_identification as last_identification,
    )
    from monitor.store.identifications import (
        load_identification as load_identification,
    )
    from monitor.store.identifications import (
        save_identification as save_identification,
    )
    from monitor.store.import_notes import (
        campaign_notes as campaign_notes,
    )
    from monitor.store.import_notes import (
        run_fingerprints as run_fingerprints,
    )
    from monitor.store.models import (
        StoredModel as StoredModel,
    )
    from monitor.store.models import (
        last_used_campaign as last_used_campaign,
    )
    from monitor.store.models import (
        list_models as list_models,
    )
    from monitor.store.models import (
        load_model as load_model,
    )
    from monitor.store.models import (
        model_history as model_history,
    )
    from monitor.store.models import (
        next_version as next_version,
    )
    from monitor.store.models import (
        save_model as save_model,
    )
    from monitor.store.past.fleet import (
        BlockCut as BlockCut,
    )
    from monitor.store.past.fleet import (
        FleetSums as FleetSums,
    )
    from monitor.store.past.fleet import (
        fleet_sums as fleet_sums,
    )
    from monitor.store.past.history import (
        MachineHistory as MachineHistory,
    )
    from monitor.store.past.history import (
        latest_tolerances as latest_tolerances,
    )
    from monitor.store.past.history import (
        machine_history as machine_history,
    )
    from monitor.store.past.history import (
        tolerance_types as tolerance_types,
    )
    from monitor.store.past.machine_runs import (
        MachineDescription as MachineDescription,
    )
    from monitor.store.past.machine_runs import (
        RecordedRun as RecordedRun,
    )
    from monitor.store.past.machine_runs import (
        campaign_machines as campaign_machines,
    )
    from monitor.store.past.machine_runs import (
        campaign_tolerances as campaign_tolerances,
    )
    from monitor.store.past.machine_runs import (
        check_campaigns as check_campaigns,
    )
    from monitor.store.past.machine_runs import (
        identified_runs as identified_runs,
    )
    from monitor.store.past.machine_runs import (
        latest_frames as latest_frames,
    )
    from monitor.store.past.machine_runs import (
        machine_descriptions as machine_descriptions,
    )
    from monitor.store.past.machine_runs import (
        machine_runs as machine_runs,
    )
    from monitor.store.past.machine_runs import (
        parameter_frames as parameter_frames,
    )
    from monitor.store.past.machine_runs import (
        probing_counts as probing_counts,
    )
    from monitor.store.recalling import Recalled as Recalled
    from monitor.store.results import (
        StoredIdentification as StoredIdentification,
    )
    from monitor.store.results import (
        StoredRun as StoredRun,
    )
    from monitor.store.selections import (
        SelectionRow as SelectionRow,
    )
    from monitor.store.selections import (
        StoredSelection as StoredSelection,
    )
    from monitor.store.selections import (
        find_selection as find_selection,
    )
    from monitor.store.selections import (
        list_selections as list_selections,
    )
    from monitor.store.selections import (
        save_selection as save_selection,
    )
    from monitor.store.sharing import (
        SharedDatabase as SharedDatabase,
    )
    from monitor.store.sharing import (
        one_at_a_time as one_at_a_time,
    )
    from monitor.store.sql import (
        QueryResult as QueryResult,
    )
    from monitor.store.sql import (
        campaign_readings as campaign_readings,
    )
    from monitor.store.sql import (
        column_comments as column_comments,
    )
    from monitor.store.sql import (
        list_machines as list_machines,
    )
    from monitor.store.sql import (
        run_query as run_query,
    )
    from monitor.store.turns import (
        Holder as Holder,
    )
    from monitor.store.turns import (
        Patience as Patience,
    )
    from monitor.store.type_tolerances import type_in_use as type_in_use
    from monitor.store.verification import (
        Verification as Verification,
    )
    from monitor.store.verification import (
        verify_audit as verify_audit,
    )
    from monitor.store.withdrawals import (
        Withdrawal as Withdrawal,
    )
    from monitor.store.withdrawals import (
        withdraw_campaign as withdraw_campaign,
    )
else:
    __getattr__, __dir__ = on_demand(
        __name__,
        {
            "analyses": "StoredAnalysis analysis_text check_analysis latest_documents latest_maps "
            "load_analysis save_analysis stored_analyses",
            "archiving": "Archived archive_faults archive_files archived_count",
            "audit": "AuditEntry anchored_entry chain_faults last_anchor last_entries",
            "campaigns": "Imported import_campaign import_curve load_campaign",
            "catalogue": "CampaignRow RunRow WithdrawnCampaign check_machine described_machines list_campaigns "
            "list_runs list_withdrawn",
            "certificates": "StoredCertificate certificate_numbers find_certificate list_certificates "
            "load_certificate mark_certificate save_certificate",
            "connection": "Database",
            "copies.backup": "take_backup",
            "copies.compaction": "Compaction compact",
            "copies.export": "export_tables",
            "copies.increment": "take_increment",
            "copies.manifest": "Backup list_backups",
            "copies.restoring": "Restored restore",
            "copies.workbook": "export_workbook",
            "curves": "curve_names is_curve load_curve",
            "database_name": "check_database_name",
            "events": "NOTE MachineEvent StoredEvent list_events machine_events record_event",
            "identifications": "identification_by_number identification_numbers last_identification "
            "load_identification save_identification",
            "import_notes": "campaign_notes run_fingerprints",
            "models": "StoredModel last_used_campaign list_models load_model model_history next_version "
            "save_model",
            "past.fleet": "BlockCut FleetSums fleet_sums",
            "past.history": "MachineHistory latest_tolerances machine_history tolerance_types",
            "past.machine_runs": "MachineDescription RecordedRun campaign_machines campaign_tolerances check_campaigns "
            "identified_runs latest_frames machine_descriptions machine_runs parameter_frames "
            "probing_counts",
            "recalling": "Recalled",
            "results": "StoredIdentification StoredRun",
            "selections": "SelectionRow StoredSelection find_selection list_selections save_selection",
            "sharing": "SharedDatabase one_at_a_time",
            "sql": "QueryResult campaign_readings column_comments list_machines run_query",
            "turns": "Holder Patience",
            "type_tolerances": "type_in_use",
            "verification": "Verification verify_audit",
            "withdrawals": "Withdrawal withdraw_campaign",
        },
    )
