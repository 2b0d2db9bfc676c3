"""A member's folder of keys: its certificate, its key, the team's authority, and who it is."""

import json
import os
import stat
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from pydantic import BaseModel, ConfigDict, ValidationError

from mapweave.errors import FileError
from mapweave.text import in_words
from mapweave_protocol.link.security.roster import Member, Role, Roster

AUTHORITY, CERTIFICATE, KEY, IDENTITY = "ca.pem", "cert.pem", "key.pem", "member.json"
MAX_IDENTITY = 2**20  # [bytes]


class _Identity(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    team: str
    role: Role
    name: str
    robots: tuple[str, ...] = ()
    operators: tuple[str, ...] = ()
    viewers: tuple[str, ...] = ()
    page: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class KeyFolder:
    """What ``--tls DIR`` names, as ``mapweave keys`` makes it.

    Attributes
    ----------
    path
        The folder.
    member
        Whose it is.
    roster
        Who belongs to the team; the router needs it, and a coordinator with a page that is served
        over the network. Others have only their own name.
    page
        Names and addresses by which others reach that page; our certificate is good for these.
    """

    path: Path
    member: Member
    roster: Roster
    page: tuple[str, ...] = ()

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read the folder `path`.

        Raises
        ------
        FileError
            If something is missing in it, or others may read the key.
        InvalidIdError
            If a name is not an id.
        """
        for name in (AUTHORITY, CERTIFICATE, KEY, IDENTITY):
            if not (path / name).is_file():
                raise FileError(path / name, "missing; expected a folder made by mapweave keys")
            if not os.access(path / name, os.R_OK):
                raise FileError(path / name, "may not be read by who runs this program")
        key = path / KEY
        if key.stat().st_mode & (stat.S_IRWXG | stat.S_IRWXO):
            raise FileError(key, "may be read by others; expected mode 0600: chmod 600")
        identity = _read_identity(path / IDENTITY)
        roster = Roster(identity.team, identity.robots, identity.operators, identity.viewers)
        member = Member(identity.team, identity.role, identity.name)
        return cls(path, member, roster, identity.page)

    def settings(self) -> dict[str, object]:
        """Return the settings of Zenoh by which a session proves who it is."""
        files = {name: str((self.path / name).resolve()) for name in (AUTHORITY, CERTIFICATE, KEY)}
        tls = {
            "root_ca_certificate": files[AUTHORITY],
            "connect_certificate": files[CERTIFICATE],
            "connect_private_key": files[KEY],
            "listen_certificate": files[CERTIFICATE],
            "listen_private_key": files[KEY],
            "enable_mtls": True,
            "verify_name_on_connect": True,
            "close_link_on_expiration": True,
        }
        return {f"transport/link/tls/{name}": value for name, value in tls.items()} | {
            "transport/link/protocols": ["tls"]
        }


def place_of(member: Member) -> Path:
    """Return the folder of a member, below that of the team's keys."""
    single = member.role in (Role.ROUTER, Role.COORDINATOR)
    return Path(member.name) if single else Path(f"{member.role.value}s") / member.name


def write_identity(
    path: Path, member: Member, roster: Roster | None, page: Sequence[str] = ()
) -> None:
    """Write who a folder is of; for who lets others in, with the whole roster."""
    fields: dict[str, object] = {
        "team": member.team,
        "role": member.role.value,
        "name": member.name,
    }
    if roster is not None:
        fields |= {
            "robots": roster.robots,
            "operators": roster.operators,
            "viewers": roster.viewers,
        }
    if page:
        fields["page"] = tuple(page)
    (path / IDENTITY).write_text(json.dumps(fields, indent=2) + "\n")


def _read_identity(path: Path) -> _Identity:
    if path.stat().st_size > MAX_IDENTITY:
        raise FileError(path, f"more than {MAX_IDENTITY} bytes; expected what mapweave keys wrote")
    try:
        return _Identity.model_validate_json(path.read_bytes())
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False, include_input=False)[0]
        place = ".".join(map(str, first["loc"]))
        problem = f"{place or 'its content'}: {in_words(first)}; expected what mapweave keys wrote"
        raise FileError(path, problem) from error
