"""Whose keys a program uses: what is another's a router drops in silence, so it is said here."""

from mapweave_protocol.errors import WrongKeysError
from mapweave_protocol.link.security.roster import Member, Role
from mapweave_protocol.link.security.settings import LinkSettings


def check_team(link: LinkSettings, team: str) -> None:
    """Check that keys, if there are any, are of `team`.

    Raises
    ------
    WrongKeysError
        If they are of another team.
    """
    if link.keys is not None and link.keys.member.team != team:
        raise WrongKeysError(link.keys.path, str(link.keys.member), f"a member of team {team}")


def check_member(link: LinkSettings, *allowed: Member) -> None:
    """Check that keys, if there are any, are of one of `allowed`.

    Raises
    ------
    WrongKeysError
        If they are of somebody else, who may not write what the program writes.
    """
    if link.keys is not None and link.keys.member not in allowed:
        expected = " or ".join(map(str, allowed))
        raise WrongKeysError(link.keys.path, str(link.keys.member), expected)


def operator_of(link: LinkSettings, given: str | None) -> str | None:
    """Return in whose name orders are given: as keys say, else as it was `given`.

    The coordinator passes on orders of others, so its keys are good for any name.

    Raises
    ------
    WrongKeysError
        If keys are of nobody who may give orders, or not in the name that was given.
    """
    if link.keys is None or link.keys.member.role is Role.COORDINATOR:
        return given
    member = link.keys.member
    if member.role is not Role.OPERATOR:
        named = "an operator" if given is None else f"operator {given}"
        raise WrongKeysError(link.keys.path, str(member), f"{named} of team {member.team}")
    if given is not None:
        check_member(link, Member(member.team, Role.OPERATOR, given))
    return member.name
