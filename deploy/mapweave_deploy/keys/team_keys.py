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
    write_identity,
)
from mapweave_protocol.link.security.roster import Member, Role, Roster

HERE = ("localhost", "127.0.0.1", "::1")


def make_keys(
    roster: Roster, folder: Path, now: datetime, days: int, hosts: Sequence[str]
) -> Iterator[str]:
    """Make what is missing in `folder`, and yield the names of members that got keys.

    Who has keys keeps them, and the router learns of everybody new: so a team grows by the same
    command with one more name.

    Parameters
    ----------
    now, days
        From when, and for how many days, certificates are valid.
    hosts
        Names and addresses of the router's machine, beside this machine's own.

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
            is_router = member.role is Role.ROUTER
            if not (path / CERTIFICATE).exists() or (is_router and hosts):
                reached = dict.fromkeys((*HERE, socket.gethostname(), *hosts))
                authority.issue(member, path, now, days, tuple(reached) if is_router else ())
                yield member.name
            write_identity(path, member, roster if is_router else None)
    except OSError as error:
        raise FileError(folder, f"cannot be written ({error.strerror or error})") from error


def place_of(member: Member) -> Path:
    """Return the folder of a member, below that of the team's keys."""
    single = member.role in (Role.ROUTER, Role.COORDINATOR)
    return Path(member.name) if single else Path(f"{member.role.value}s") / member.name


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
