"""How robots and coordinator are, as JSON."""

from collections.abc import Sequence
from typing import Any

from mapweave_fusion_server.web.feed import CoordinatorReport, RobotReport, Seen
from mapweave_protocol.wire.messages import StatusMessage


def team_content(team: str, series: str, seen: Seen, robots: Sequence[str]) -> dict[str, Any]:
    """Return what ``/api/robots`` says.

    Parameters
    ----------
    robots
        Robots that are known from their maps, whether they were heard of or not.
    """
    heard = {report.robot: report for report in seen.robots}
    silent = {name: RobotReport(name, 0, None, None, None) for name in robots}
    known = silent | heard
    return {
        "robots": [_robot(known[name]) for name in sorted(known)],
        "coordinator": _coordinator(team, series, seen.version, seen.coordinator),
    }


def _robot(report: RobotReport) -> dict[str, Any]:
    return {
        "robot": report.robot,
        "alive": report.runs > 0,
        "runs": report.runs,
        "heard": report.heard,
        "map_version": report.map_version,
        "status": None if report.status is None else _status(report.status),
    }


def _status(status: StatusMessage) -> dict[str, Any]:
    return {
        "boot": status.boot,
        "state": status.state,
        "scans_seen": status.scans_seen,
        "scans_placed": status.scans_placed,
        "scans_total": status.scans_total,
        "components": status.components,
        "submaps": status.submaps,
        "map_version": status.map_version,
        "compared": sorted(status.compared),
        "sent": {
            kind: {"messages": t.messages, "bytes": t.bytes} for kind, t in status.sent.items()
        },
    }


def _coordinator(team: str, series: str, version: int, report: CoordinatorReport) -> dict[str, Any]:
    return {
        "team": team,
        "series": series,
        "version": version,
        "boot": report.boot,
        "started": report.started,
        "stamp": report.stamp,
        "pending": report.pending,
        "refused": report.refused,
        "refusals": [[*who, count] for who, count in sorted(report.refusals.items())],
        "dropped": report.dropped,
        "storing": report.storing,
        "damaged": report.damaged,
    }
