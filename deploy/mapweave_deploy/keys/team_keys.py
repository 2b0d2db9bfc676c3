"""A folder of keys for each member of a team, from the roster."""

import socket
from collections.abc import Iterator, Sequence
from datetime import datetime
from pathlib import Path

from mapweave.errors import FileError
from mapweave_deploy.keys.authority import AUTHORITY_KEY, Authority
from mapweave_protocol.link.security.folder import (
    CERTIFICATE,
    IDENTITY,
    KeyFolder,
    place_of,
    write_identity,
)
from mapweave_protocol.link.security.roster import Member, Role, Roster

HERE = ("localhost", "127.0.0.1", "::1")


def make_keys(
    roster: Roster,
    folder: Path,
    now: datetime,
    days: int,
    hosts: Sequence[str],
    page: Sequence[str] = (),
) -> Iterator[str]:
    """Make what is missing in `folder`, and yield the names of members that got keys.

    Who has keys keeps them, and those who let others in learn of everybody new: so a team grows by
    the same command with one more name.

    Parameters
    ----------
    now, days
        From when, and for how many days, certificates are valid.
    hosts
        Names and addresses of the router's machine, beside this machine's own.
    page
        Likewise of the coordinator's, where others are to reach its page.

    Raises
    ------
    FileError
        If `folder` cannot be written, or holds the keys of another team.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        authority = _authority(roster.team, folder, now, days)
        roster = _with_earlier(roster, folder)
        for member in roster.members:
            path = folder / place_of(member)
            path.mkdir(parents=True, exist_ok=True, mode=0o700)
            given = {Role.ROUTER: hosts, Role.COORDINATOR: page}.get(member.role, ())
            if not (path / CERTIFICATE).exists() or given:
                authority.issue(member, path, now, days, _reached(member, given))
                yield member.name
            _write_identity(path, member, roster, given)
    except OSError as error:
        raise FileError(folder, f"cannot be written ({error.strerror or error})") from error


def _reached(member: Member, given: Sequence[str]) -> tuple[str, ...]:
    """Return all names of the machine of a member that serves others; none of one that does not."""
    if member.role is not Role.ROUTER and not given:
        return ()
    return tuple(dict.fromkeys((*HERE, socket.gethostname(), *given)))


def _write_identity(path: Path, member: Member, roster: Roster, given: Sequence[str]) -> None:
    page: Sequence[str] = ()
    if member.role is Role.COORDINATOR:
        known = KeyFolder.read(path).page if (path / IDENTITY).exists() else ()
        page = given or known
    lets_in = member.role is Role.ROUTER or page
    write_identity(path, member, roster if lets_in else None, page)


def _with_earlier(roster: Roster, folder: Path) -> Roster:
    """Return `roster` with those that the router knows already."""
    path = folder / place_of(roster.members[0])
    if not (path / IDENTITY).exists():
        return roster
    known = KeyFolder.read(path).roster
    robots, operators, viewers = (
        tuple(dict.fromkeys((*before, *now)))
        for before, now in (
            (known.robots, roster.robots),
            (known.operators, roster.operators),
            (known.viewers, roster.viewers),
        )
    )
    return Roster(roster.team, robots, operators, viewers)


def _authority(team: str, folder: Path, now: datetime, days: int) -> Authority:
    if not (folder / AUTHORITY_KEY).exists():
        authority = Authority.make(team, now, days)
        authority.write(folder)
        return authority
    authority = Authority.read(folder)
    if authority.certificate.subject.rfc4514_string() != f"CN=mapweave {team}":
        raise FileError(folder, f"the keys of another team than {team!r}")
    return authority
