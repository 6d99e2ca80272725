"""Tells what came to a watched folder: the same lines on a screen and in an e-mail."""

from __future__ import annotations

from pathlib import Path

from monitor.reporting import messages
from monitor.workflow.health.mail import composed, message_of, read_mail_settings, send
from monitor.workflow.watching.request import WatchAnswer


def lines_of(answer: WatchAnswer) -> list[str]:
    """Return what came and what was refused, a sentence a line."""
    lines = []
    for campaign in answer.arrived:
        size = (campaign.runs, "runs") if campaign.rows is None else (campaign.rows, "rows")
        why_not = None if campaign.identified else str(campaign.why_not)
        lines.append(
            messages.arrived(campaign.campaign, campaign.state, str(campaign.arrival), size, why_not)
        )
        lines += [f"note: {note}" for note in campaign.notes]
    for refused in answer.refused:
        lines.append(messages.arrival_refused(refused.folder))
        lines += [f"  {line}" for line in refused.why.splitlines()]
    return lines


def mailed(path: Path, answer: WatchAnswer) -> tuple[str, ...]:
    """Send what came as a configuration of mail says; the addresses it went to.

    With ``only_on_alarm`` nothing is sent unless an arrival was refused or a machine alarms. Raises InputError where it
    could not be sent.
    """
    settings = read_mail_settings(path)
    alarms = answer.report is not None and bool(answer.report.alarms)
    troubled = alarms or bool(answer.refused) or any(not campaign.identified for campaign in answer.arrived)
    if settings.only_on_alarm and not troubled:
        return ()
    counts = [f"{len(answer.arrived)} imported"] if answer.arrived else []
    counts += [f"{len(answer.refused)} refused"] if answer.refused else []
    subject, lines = f"Campaigns: {', '.join(counts)}", lines_of(answer)
    if answer.report is not None:
        report = message_of(settings, answer.report)
        subject += f"; {report['Subject']}"
        body = report.get_body(("plain",))
        lines += ["", *(str(body.get_content()).splitlines() if body is not None else [])]
    files = () if answer.report is None else answer.report.files
    return tuple(send(settings, composed(settings, subject, lines, files)))
