"""Who asks, by the certificate shown: uvicorn checks it, and tells applications nothing of it."""

from collections.abc import Mapping
from typing import Any

from starlette.requests import Request
from starlette.types import Scope

from mapweave_protocol.link.security.roster import Member, Role

_NAME, _MEMBER = "common-name", "member"


def note_certificate(
    state: Mapping[str, Any], certificate: Mapping[str, Any] | None
) -> dict[str, Any]:
    """Return a connection's state with whose certificate was shown, as `ssl` tells that."""
    subject = (certificate or {}).get("subject", ())
    names = [value for part in subject for key, value in part if key == "commonName"]
    return {**state, _NAME: names[0] if len(names) == 1 else None}


def shown_name(scope: Scope) -> str | None:
    """Return to whom the certificate is made out that came with a request."""
    name: str | None = scope.get("state", {}).get(_NAME)
    return name


def note_member(scope: Scope, member: Member) -> None:
    """Note who asks."""
    scope.setdefault("state", {})[_MEMBER] = member


def operator_of(request: Request) -> str | None:
    """Return the operator whose request it is; None on a page that knows nobody."""
    member: Member | None = request.scope.get("state", {}).get(_MEMBER)
    return member.name if member is not None and member.role is Role.OPERATOR else None
