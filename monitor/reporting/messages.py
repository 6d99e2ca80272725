"""What verbs say of what they did, and of what speaks against a certificate or a database: words for numbers."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from datetime import datetime

#: What is said of a slope that a season may be all of.
DRIFT_OR_SEASON = "drift or season cannot be told apart"
#: What is said of a step after which there is one day alone.
ONE_DAY = "the latest day alone cannot show whether it stays: measure again"
#: What is said of a parameter of the fleet in place of its class, where that is so.
_MOVES = {
    "drifts out of tolerance within a year": f"reaches its tolerance within a year at this rate; {DRIFT_OR_SEASON}",
    "drifts": f"moves; {DRIFT_OR_SEASON}",
}
#: What is said of slopes over too short a history to show a season.
SEASON_NOT_TOLD = (
    "the history is too short to tell a drift from a part of a yearly season: slopes hold it, their intervals and the "
    "forecasts allow for a season as large as what was seen (the temperature of six groups of days tells, or 300 days)"
)


def joined_by_and(names: Sequence[object]) -> str:
    """Return names with commas, the last two joined by ``and``."""
    *first, last = map(str, names)
    return f"{', '.join(first)} and {last}" if first else last


def joint_region_lacks(needed: int, fewest: float) -> str:
    """Return how many degrees of freedom a joint region needs, how many there are, and what would do."""
    more = math.ceil(needed - fewest)
    if more < 1:
        return f", and have {fewest:.4g} of the part with the fewest"
    runs = "1 more run" if more == 1 else f"{more} more runs"
    return f", at least {needed}, and have {fewest:.4g}: {runs} on days of repeated runs would do"


def region_for_others(others: Sequence[str]) -> str:
    """Return for which other times there is a region as it is, for the end of a refusal; empty where for none."""
    by_time = {
        "run": "`--holds-for run` (the run itself)",
        "day": "`--holds-for day` (the day of the run)",
        "campaign": "`--holds-for campaign` (other days too)",
    }
    listed = " or ".join(by_time[other] for other in others)
    return f", unless it is to hold for another time: there is a region with {listed}" if others else ""


def model_refuted(campaigns: Sequence[str], judged: int, model: str, p_value: float) -> str:
    """Return that the readings of campaigns, the latest last, refute its model, and what to type.

    ``p_value`` is that of the latest, ``judged`` how many campaigns could say so.
    """
    p = "p < 0.0001" if p_value < 1e-4 else f"p = {p_value:.4f}"
    of_all = "" if judged == 1 else f"; so do {len(campaigns)} of the {judged} campaigns that can say so"
    if len(campaigns) == 1:
        of_all = "" if judged == 1 else f"; of {judged} campaigns that can say so no other does"
    return (
        f"the readings of {campaigns[-1]} refute the model {model} beyond noise (lack of fit, {p}){of_all}: the values "
        f"hold what it lacks and may step or drift with it; type `monitor explain {campaigns[-1]}`"
    )


def who_has(campaign: str | None) -> str:
    """Return the words before a list of what a ``campaign`` has, or all campaigns of the database."""
    return "the campaigns of this database have" if campaign is None else f"campaign {campaign} has"


def simulated(campaigns: Sequence[str], of: int, most: int = 5) -> str:
    """Return which ``campaigns`` among those ``of`` a history nobody measured."""
    named = ", ".join(campaigns[:most]) + (
        f" and {len(campaigns) - most} more" if len(campaigns) > most else ""
    )
    if len(campaigns) == of:
        return f"simulated readings, nobody measured them: {named}"
    return (
        f"simulated readings stand among measured ones: {named}; a rehearsal should have a machine of its own: "
        "withdraw these campaigns"
    )


def machines_simulated(machines: Mapping[str, Sequence[str]], most: int) -> str:
    """Return which ``machines`` have simulated campaigns, and how many."""
    named = ", ".join(
        f"{machine} ({'1 campaign' if len(campaigns) == 1 else f'{len(campaigns)} campaigns'})"
        for machine, campaigns in list(machines.items())[:most]
    )
    more = f" and {len(machines) - most} more" if len(machines) > most else ""
    return f"simulated, nobody measured it: {named}{more}"


def machines_refuted(machines: Mapping[str, str], most: int) -> str:
    """Return which ``machines`` (with their latest campaigns) have readings that refute their model."""
    named = ", ".join(f"{machine} ({campaign})" for machine, campaign in list(machines.items())[:most])
    more = f" and {len(machines) - most} more" if len(machines) > most else ""
    return (
        f"the latest readings refute the model that the values come from: {named}{more}; "
        f"type `monitor explain {next(iter(machines.values()))}`"
    )


def machines_lacking(machines: Mapping[str, str], most: int) -> str:
    """Return which ``machines`` (with their latest campaigns) have a latest comparison that misses something."""
    named = ", ".join(f"{machine} ({campaign})" for machine, campaign in list(machines.items())[:most])
    more = f" and {len(machines) - most} more" if len(machines) > most else ""
    return (
        f"the latest comparison says that the model lacks something: {named}{more}; "
        f"type `monitor explain {next(iter(machines.values()))}`"
    )


#: The class of machines whose numbers ask for nothing, by a model that does not explain their latest readings.
UNEXPLAINED = "the model does not explain the latest readings"


def times_stated(times: float) -> str:
    """Return how far readings lie from a model, for a place behind the statement that they do not fit."""
    return f"residuals {times:.2g} times the stated uncertainty"


def statement_contradicted(campaign: str, run: int, times: float) -> str:
    """Return that the last ``run`` of a ``campaign`` contradicts what is stated of its readings, and what to type."""
    return (
        f"the residuals of run {run} of {campaign} are {times:.2g} times what the stated uncertainties leave: a "
        f"statement, a reading or the model is wrong, and the values may be; type `monitor explain {campaign}`"
    )


def machines_contradicting(machines: Mapping[str, tuple[str, float]], most: int) -> str:
    """Return which ``machines`` have a last run that contradicts what is stated: its campaign, and how many times."""
    named = ", ".join(
        f"{machine} ({campaign}: {times_stated(times)})"
        for machine, (campaign, times) in list(machines.items())[:most]
    )
    more = f" and {len(machines) - most} more" if len(machines) > most else ""
    return (
        f"the latest readings contradict what is stated of them: {named}{more}; a statement, a reading or the model is "
        f"wrong; type `monitor explain {next(iter(machines.values()))[0]}`"
    )


def more_copies(count: int) -> str:
    """Return how many more campaigns hold runs of others than are named, and what names them."""
    return f"{count} more campaign{'s hold' if count > 1 else ' holds'} runs of others; `monitor campaigns` names all"


def campaigns_of_same_hours(machine: str, campaigns: Sequence[str]) -> str:
    """Return which ``campaigns`` a machine cannot all have made, and what to do about it."""
    return (
        f"campaigns {joined_by_and(campaigns)} of {machine} hold runs of the same hours, which one machine cannot have "
        f"made; the numbers here mix them: see the one that counts alone with `monitor trend {machine} --campaign "
        f"{campaigns[0]}`, and withdraw what is not its own with `monitor withdraw`"
    )


def numbers_of_older_version(machine: str, version: str, newest: str) -> str:
    """Return which ``version`` of a model the numbers of a machine are of, while the ``newest`` lacks campaigns."""
    return (
        f"the numbers of {machine} are of {version}, the newest version that all its campaigns have; {newest} is "
        "newer: type `monitor identify`"
    )


def attention_words(attention: str, season_not_told: bool | None) -> str:
    """Return the class of a parameter of the fleet; of a slope that may be a season not that it drifts."""
    return _MOVES.get(attention, attention) if season_not_told else attention


def only_understood(campaign: str, rows: int, runs: int | None = None) -> str:
    """Return what is said of a folder that was read and not stored: ``rows`` of a curve, or probings of ``runs``."""
    counted = f"{rows} rows" if runs is None else f"{runs} run{'' if runs == 1 else 's'}, {rows} probings"
    return f"{campaign}: understood, {counted}; nothing was stored"


def campaign_withdrawn(campaign: str) -> str:
    """Return what is said of a campaign that counts no longer."""
    return f"{campaign}: withdrawn, it no longer counts; its name is free for the corrected folder"


def name_means_another(name: str, label: str, before: int) -> str:
    """Return the note for other users of a model's name that means another version from now on."""
    return (
        f"'{name}' without a version means {label} from now on, for everybody and every campaign; {name}@{before} is "
        f"what it was (--as NAME leaves {name} alone)"
    )


def not_reproduced(identification: int, difference: str) -> str:
    """Return what is said of an identification that comes out otherwise when it is computed again."""
    return f"identification {identification} cannot be reproduced from the stored readings: {difference}"


def made_by_another_version(identification: int, version: str, day: str, difference: str) -> str:
    """Return what is said of an identification that another version of this software computed otherwise."""
    return (
        f"identification {identification} was computed by another version of this software ({version}, on {day}); "
        f"computed anew by this one, {difference}. That is no fault; `monitor identify` stores it anew"
    )


OTHER_RUNS_OR_PARAMETERS = "its runs or parameters are others"


def parameter_differs(name: str, run: int, campaign: str, by_u: float) -> str:
    """Return by how many standard uncertainties a parameter of a run differs."""
    return f"{name} of run {run} of {campaign} differs by {by_u:.2g} standard uncertainties"


THIS_SOFTWARE = "this software"


def remade_with_others(others: Mapping[str, tuple[str, str]]) -> str:
    """Return why a certificate comes out otherwise: versions then and here, by name."""
    named = ", ".join(f"{name} {then} (here {present})" for name, (then, present) in others.items())
    return _remade(f"it was made with {named}")


def remade_with_other_texts(version: str) -> str:
    """Return why a certificate comes out otherwise although all versions are the same."""
    return _remade(f"it was made with the same {version} of this software, but with other templates or texts")


def _remade(why: str) -> str:
    return f"{why}; the stored document is unchanged where `monitor verify` says so"


WITHOUT_SIGNATURE = (
    "the file is not signed, and who names trusted signers asks for a signature of one of them"
)
NO_PDF = "it is no PDF"
DRAFT = "it is a draft"
ALTERED = "altered, or not from here"


def other_hash(sha256: str) -> str:
    """Return what is said of a file whose hash is not the one noted elsewhere."""
    return f"the file has the hash {sha256}, not the one noted elsewhere"


def other_signer(stated: tuple[str, str], actual: tuple[str, str] | None) -> str:
    """Return that another signed than the certificate states: name and SHA-256 of each (None: nobody)."""
    signer = "nobody" if actual is None else f"{actual[0]} ({actual[1]})"
    return f"the certificate states that {stated[0]} ({stated[1]}) signs it, and {signer} does"


def unknown_content(file: str, why: str) -> str:
    """Return that a file is no certificate of this database."""
    return f"no certificate of this database has the content of {file}: {why}"


def no_longer_valid(number: str, state: str, replaced_by: str | None, reason: str | None) -> str:
    """Return that a genuine certificate was amended or withdrawn."""
    replaced = f", replaced by {replaced_by}" if replaced_by else ""
    return f"certificate {number} is {state}, no longer valid{replaced}: {reason}"


def campaign_of_certificate_withdrawn(campaign: str, number: str, why: str) -> str:
    """Return that the campaign of a certificate counts no longer."""
    return f"the campaign {campaign}, which certificate {number} rests on, was withdrawn: {why}"


def no_tolerance(campaign: str, names: Sequence[str], *, by_map: bool) -> str:
    """Return that a campaign states no tolerance of the results; ``by_map``: it limits the volumetric error."""
    volumetric = "; its limit of the volumetric error is decided with --map" if by_map else ""
    return (
        f"campaign {campaign} states no tolerance of {', '.join(names)}: a statement of conformity needs "
        f"[machine.tolerances] in its campaign.toml{volumetric}"
    )


def conformity_replaced(rule: str, said: str) -> str:
    """Return that a statement of conformity by a rule stands in place of the laboratory's sentence."""
    return (
        f"the statement of conformity by '{rule}' counts; what the laboratory's file states under [statements] "
        f'conformity is not printed: "{said}"'
    )


def conformity_asked_for_after_all(rule: str, why_none: str) -> str:
    """Return that conformity is stated by a rule, though the laboratory's file says that it does not apply."""
    return (
        f"conformity is stated by '{rule}', though [statements] conformity of the laboratory's file says that it does "
        f'not apply: "{why_none}"; leave out --conformity, or change the file, if that is right'
    )


def differs_from(number: str, first: int, length: int, genuine: int) -> str:
    """Return where a document differs from the certificate whose number it bears; lengths in bytes."""
    return (
        f"it bears the number {number}, but differs from the document of that certificate from byte {first} on "
        f"({length} bytes, where the genuine one has {genuine})"
    )


def none_determined(names: Sequence[str]) -> str:
    """Return that a plan determines no parameter of a model, and where it is said why."""
    which = f"none of {', '.join(names)}" if names else "no parameter of the model"
    return (
        f"the plan determines {which}: `monitor identify` says what each cannot be told apart from; "
        f"add poses, or state what the setups leave unknown"
    )


def limits_of_type(machine_type: str) -> str:
    """Return where the limits of a trend come from, where they are not the campaign's own."""
    whose = f"the machine type '{machine_type}' in the configuration"
    return f"limits are those of {whose}: the latest campaign states none"


def limit_of_no_axis(machine_type: str, limit: str, hint: str) -> str:
    """Return that a limit of a machine type is of an axis that no parameter is of, and what may be meant."""
    return (
        f"the limit {limit} of the machine type '{machine_type}' in the configuration is of no parameter of this "
        f"machine; {hint.strip()}"
    )


def limits_of_others(machine_type: str, limits: Sequence[str], hint: str) -> str:
    """Return that none of the ``limits`` of a machine type is of a parameter of the machine; ``hint`` may be empty."""
    named = ", ".join(limits[:5]) + (f" and {len(limits) - 5} more" if len(limits) > 5 else "")
    return (
        f"no limit holds: the machine type '{machine_type}' in the configuration limits {named}, of which the model of "
        f"this machine has none; {hint}`monitor config show` names the file"
    )


def not_identified_by_model(machine: str, campaigns: Sequence[str], refused: Mapping[str, str]) -> str:
    """Return which campaigns a trend leaves out, and how to have them; of those ``refused``, why `identify` refuses."""
    open_ones = [campaign for campaign in campaigns if campaign not in refused]
    ways = [f"type `monitor identify {open_ones[0]}`"] if open_ones else []
    ways += [
        f"`identify` refuses {'it' if len(campaigns) == 1 else campaign}: {refused[campaign]}"
        for campaign in campaigns
        if campaign in refused
    ]
    return (
        f"not identified by the model that {machine} is followed by, and left out: {', '.join(campaigns)}; "
        f"{'; '.join(ways)}"
    )


def before_all_runs(machine: str, first: datetime) -> str:
    """Return that an event lies before the first run of its machine, in UTC."""
    return (
        f"recorded, and it lies before the first run of {machine} ({first:%Y-%m-%d %H:%M} UTC): it splits nothing "
        "until earlier runs are imported; an event that is wrong can be withdrawn"
    )


def without_rows(tables: Sequence[str], machine: str | None) -> str:
    """Return which tables of an export have their head alone."""
    return f"{', '.join(tables)}: no row" + ("" if machine is None else f" of {machine}")


def lacks_campaigns(sheets: Sequence[str], campaigns: Sequence[str]) -> str:
    """Return which campaigns the sheets of a workbook do not hold, because they are not identified yet."""
    named = ", ".join(campaigns[:8]) + (f" and {len(campaigns) - 8} more" if len(campaigns) > 8 else "")
    return f"{', '.join(sheets)}: without {named}, not identified yet; type `monitor identify`"


def no_identified_run(
    machine: str, campaigns: Sequence[str], since: datetime | None, *, is_narrowed: bool = False
) -> str:
    """Return that a trend has no run; ``is_narrowed`` where the choice of runs is more than these."""
    when = "yet" if since is None else f"since {since:%Y-%m-%d}"
    campaign = f" of campaign {', '.join(campaigns)}" if campaigns else ""
    if is_narrowed:
        return f"machine {machine} has no identified run{campaign} among those that were chosen"
    return f"machine {machine} has no identified run{campaign} {when}"


def arrived(campaign: str, state: str, arrival: str, size: tuple[int, str], why_not: str | None) -> str:
    """Return what came to a watched folder: its size as a number of what, and why it is not identified."""
    what = "identified" if why_not is None else f"NOT identified: {why_not}"
    return f"{campaign}: {state} from {arrival}, {size[0]} {size[1]}; {what}"


def may_still_be_copied(seconds: float) -> str:
    """Return why an arrival waits that changed so many seconds ago."""
    return f"it changed {seconds:.0f} s ago and may still be copied"


def arrival_refused(folder: object) -> str:
    """Return that a folder was refused."""
    return f"refused, and left where it is: {folder}"


#: What the kinds of change are, for whoever reads a table of them.
_CHANGES = {
    "step": "the values step here",
    "slope": "the values bend here: size is the change of the slope",
    "trend": "the values drift from here on: size is the slope",
    "transient": "the values begin off by size and settle, as of warming up or running in",
}


def change_in_words(kind: str, season_not_told: bool) -> str:
    """Return what a kind of change is, whether a season can be all of a slope, and where it was computed."""
    what = _CHANGES[kind]
    return as_trend_computes(f"{what}; {DRIFT_OR_SEASON}" if season_not_told else what)


def as_trend_computes(what: str) -> str:
    """Return what a row of a table says, and where that was computed."""
    return f"{what}; computed from the runs, as `monitor trend` does"


def no_change(parameters: int, whys: Collection[str]) -> str:
    """Return that a search of so many parameters has no change, or the reasons why nothing was searched."""
    if not parameters:
        return "no run of this machine has parameters"
    if whys:
        return "; ".join(sorted(whys))
    return f"no change of any of {parameters} parameters beyond chance"
