"""The store: one DuckDB file with the campaigns, their raw files, and everything that was computed.

``Database(path)`` opens it (a ``with`` statement closes it); the functions here take it as their first
argument. People who query with SQL start from the views ``v_*``; every table and column has a COMMENT with
its unit. Only this room imports duckdb.
"""

from typing import TYPE_CHECKING

from monitor.on_demand import on_demand
from monitor.store.machine_models import (
    MachineModel as MachineModel,
    OlderNumbers as OlderNumbers,
    followed_by as followed_by,
    machine_model as machine_model,
    machine_models as machine_models,
    machines_of_method as machines_of_method,
    machines_with_runs as machines_with_runs,
    not_identified as not_identified,
    numbered_by as numbered_by,
    older_numbers as older_numbers,
    save_machine_model as save_machine_model,
    without_part as without_part,
)
from monitor.store.refusals import (
    StoredRefusal as StoredRefusal,
    clear_refusals as clear_refusals,
    record_refusal as record_refusal,
    refusals as refusals,
)

if TYPE_CHECKING:
    from monitor.store.analyses import (
        MappedRun as MappedRun,
        StoredAnalysis as StoredAnalysis,
        analysis_text as analysis_text,
        check_analysis as check_analysis,
        latest_documents as latest_documents,
        latest_maps as latest_maps,
        latest_text as latest_text,
        load_analysis as load_analysis,
        mapped_runs as mapped_runs,
        save_analysis as save_analysis,
        stored_analyses as stored_analyses,
    )
    from monitor.store.archiving import (
        Archived as Archived,
        archive_faults as archive_faults,
        archive_files as archive_files,
        archived_count as archived_count,
    )
    from monitor.store.audit import (
        AuditEntry as AuditEntry,
        anchored_entry as anchored_entry,
        chain_faults as chain_faults,
        last_anchor as last_anchor,
        last_entries as last_entries,
    )
    from monitor.store.campaigns import (
        Imported as Imported,
        import_campaign as import_campaign,
        import_curve as import_curve,
        load_campaign as load_campaign,
    )
    from monitor.store.catalogue import (
        CampaignRow as CampaignRow,
        RunRow as RunRow,
        WithdrawnCampaign as WithdrawnCampaign,
        check_machine as check_machine,
        described_machines as described_machines,
        described_setups as described_setups,
        list_campaigns as list_campaigns,
        list_runs as list_runs,
        list_withdrawn as list_withdrawn,
    )
    from monitor.store.certificates import (
        StoredCertificate as StoredCertificate,
        certificate_numbers as certificate_numbers,
        certificates_in_force as certificates_in_force,
        find_certificate as find_certificate,
        list_certificates as list_certificates,
        load_certificate as load_certificate,
        mark_certificate as mark_certificate,
        save_certificate as save_certificate,
    )
    from monitor.store.connection import Database as Database
    from monitor.store.copies.backup import (
        take_backup as take_backup,
    )
    from monitor.store.copies.compaction import (
        Compaction as Compaction,
        compact as compact,
    )
    from monitor.store.copies.export import (
        export_tables as export_tables,
        tables_without_rows as tables_without_rows,
    )
    from monitor.store.copies.increment import take_increment as take_increment
    from monitor.store.copies.manifest import (
        Backup as Backup,
        list_backups as list_backups,
    )
    from monitor.store.copies.restoring import (
        Restored as Restored,
        restore as restore,
    )
    from monitor.store.copies.workbook import (
        check_workbook_path as check_workbook_path,
        export_workbook as export_workbook,
    )
    from monitor.store.copies.workbook_sheets import (
        CHANGES as CHANGES,
        ComputedChange as ComputedChange,
    )
    from monitor.store.copies_of_runs import (
        CopiedCampaign as CopiedCampaign,
        CopiedRun as CopiedRun,
        campaign_notes as campaign_notes,
        campaign_numbers as campaign_numbers,
        copied_campaigns as copied_campaigns,
        copied_runs as copied_runs,
        copy_notes as copy_notes,
        noted_campaigns as noted_campaigns,
    )
    from monitor.store.curves import (
        curve_names as curve_names,
        is_curve as is_curve,
        load_curve as load_curve,
    )
    from monitor.store.database_name import check_database_name as check_database_name
    from monitor.store.events import (
        NOTE as NOTE,
        MachineEvent as MachineEvent,
        StoredEvent as StoredEvent,
        list_events as list_events,
        machine_events as machine_events,
        record_event as record_event,
    )
    from monitor.store.held_sizes import held_bytes as held_bytes
    from monitor.store.identifications import (
        MadeBy as MadeBy,
        identification_by_number as identification_by_number,
        identifications_made as identifications_made,
        last_identification as last_identification,
        load_identification as load_identification,
        save_identification as save_identification,
    )
    from monitor.store.import_notes import run_fingerprints as run_fingerprints
    from monitor.store.models import (
        StoredModel as StoredModel,
        last_used_campaign as last_used_campaign,
        list_models as list_models,
        load_model as load_model,
        model_history as model_history,
        next_version as next_version,
        save_model as save_model,
    )
    from monitor.store.past.fleet import (
        BlockCut as BlockCut,
        FleetSums as FleetSums,
        GroupHours as GroupHours,
        fleet_sums as fleet_sums,
    )
    from monitor.store.past.history import (
        FEWEST_STEADY as FEWEST_STEADY,
        CampaignFit as CampaignFit,
        MachineHistory as MachineHistory,
        latest_tolerances as latest_tolerances,
        machine_history as machine_history,
        tolerance_types as tolerance_types,
    )
    from monitor.store.past.lack_of_fit import (
        ContradictingMachine as ContradictingMachine,
        RefutedMachine as RefutedMachine,
        contradicting_machines as contradicting_machines,
        refuted_machines as refuted_machines,
        unexplained_machines as unexplained_machines,
    )
    from monitor.store.past.machine_runs import (
        MachineDescription as MachineDescription,
        RecordedRun as RecordedRun,
        campaign_machines as campaign_machines,
        campaign_tolerances as campaign_tolerances,
        check_campaigns as check_campaigns,
        earlier_frames as earlier_frames,
        identified_runs as identified_runs,
        latest_frames as latest_frames,
        machine_descriptions as machine_descriptions,
        machine_runs as machine_runs,
        machine_topology as machine_topology,
        parameter_frames as parameter_frames,
        probing_counts as probing_counts,
    )
    from monitor.store.past.simulated import simulated_campaigns as simulated_campaigns
    from monitor.store.recalling import Recalled as Recalled
    from monitor.store.results import (
        LackOfFit as LackOfFit,
        StoredIdentification as StoredIdentification,
        StoredRun as StoredRun,
    )
    from monitor.store.selections import (
        SelectionRow as SelectionRow,
        StoredSelection as StoredSelection,
        find_selection as find_selection,
        list_selections as list_selections,
        save_selection as save_selection,
    )
    from monitor.store.sharing import (
        SharedDatabase as SharedDatabase,
        one_at_a_time as one_at_a_time,
    )
    from monitor.store.sql import (
        QueryResult as QueryResult,
        campaign_readings as campaign_readings,
        column_comments as column_comments,
        list_machines as list_machines,
        run_query as run_query,
    )
    from monitor.store.turns import (
        Holder as Holder,
        Patience as Patience,
        activity as activity,
    )
    from monitor.store.type_tolerances import type_in_use as type_in_use
    from monitor.store.verification import (
        Verification as Verification,
        unrecorded as unrecorded,
        verify_audit as verify_audit,
    )
    from monitor.store.withdrawals import (
        Withdrawal as Withdrawal,
        withdraw_campaign as withdraw_campaign,
    )
    from monitor.store.withdrawn_events import withdraw_event as withdraw_event
else:
    __getattr__, __dir__ = on_demand(
        __name__,
        {
            "analyses": "MappedRun StoredAnalysis analysis_text check_analysis latest_documents latest_maps "
            "latest_text load_analysis mapped_runs save_analysis stored_analyses",
            "archiving": "Archived archive_faults archive_files archived_count",
            "audit": "AuditEntry anchored_entry chain_faults last_anchor last_entries",
            "campaigns": "Imported import_campaign import_curve load_campaign",
            "catalogue": "CampaignRow RunRow WithdrawnCampaign check_machine described_machines described_setups "
            "list_campaigns list_runs list_withdrawn",
            "certificates": "StoredCertificate certificate_numbers certificates_in_force find_certificate "
            "list_certificates load_certificate mark_certificate save_certificate",
            "connection": "Database",
            "copies_of_runs": "CopiedCampaign CopiedRun campaign_notes campaign_numbers copied_campaigns copied_runs "
            "copy_notes "
            "noted_campaigns",
            "copies.backup": "take_backup",
            "copies.compaction": "Compaction compact",
            "copies.export": "export_tables tables_without_rows",
            "copies.increment": "take_increment",
            "copies.manifest": "Backup list_backups",
            "copies.restoring": "Restored restore",
            "copies.workbook": "check_workbook_path export_workbook",
            "copies.workbook_sheets": "CHANGES ComputedChange",
            "curves": "curve_names is_curve load_curve",
            "database_name": "check_database_name",
            "events": "NOTE MachineEvent StoredEvent list_events machine_events record_event",
            "identifications": "MadeBy identification_by_number identifications_made last_identification "
            "load_identification save_identification",
            "import_notes": "run_fingerprints",
            "models": "StoredModel last_used_campaign list_models load_model model_history next_version "
            "save_model",
            "past.fleet": "BlockCut FleetSums GroupHours fleet_sums",
            "past.history": "FEWEST_STEADY CampaignFit MachineHistory latest_tolerances machine_history "
            "tolerance_types",
            "past.lack_of_fit": "ContradictingMachine RefutedMachine contradicting_machines refuted_machines "
            "unexplained_machines",
            "past.simulated": "simulated_campaigns",
            "past.machine_runs": "MachineDescription RecordedRun campaign_machines campaign_tolerances check_campaigns "
            "earlier_frames identified_runs latest_frames machine_descriptions machine_runs machine_topology "
            "parameter_frames probing_counts",
            "held_sizes": "held_bytes",
            "recalling": "Recalled",
            "results": "LackOfFit StoredIdentification StoredRun",
            "selections": "SelectionRow StoredSelection find_selection list_selections save_selection",
            "sharing": "SharedDatabase one_at_a_time",
            "sql": "QueryResult campaign_readings column_comments list_machines run_query",
            "turns": "Holder Patience activity",
            "type_tolerances": "type_in_use",
            "verification": "Verification unrecorded verify_audit",
            "withdrawals": "Withdrawal withdraw_campaign",
            "withdrawn_events": "withdraw_event",
        },
    )
