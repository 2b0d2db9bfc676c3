"""Who asks, by the certificate shown: uvicorn checks it, and tells applications nothing of it."""

import asyncio
from collections.abc import Mapping
from typing import Any

from starlette.requests import Request
from starlette.types import Scope
from uvicorn.protocols.http.h11_impl import H11Protocol

from mapweave_protocol.link.security.roster import Member, Role

_CERTIFICATE, _MEMBER = "certificate", "member"


class CertifiedProtocol(H11Protocol):
    """HTTP/1.1 that hands on to whom the other side's certificate is made out."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Note the common name, which no request of this connection can say otherwise."""
        super().connection_made(transport)
        shown = transport.get_extra_info("peercert")
        self.app_state = {**self.app_state, _CERTIFICATE: common_name(shown)}


def common_name(certificate: Mapping[str, Any] | None) -> str | None:
    """Return the one common name of a certificate as `ssl` tells it, None if it has not one."""
    subject = (certificate or {}).get("subject", ())
    names = [value for part in subject for key, value in part if key == "commonName"]
    return names[0] if len(names) == 1 else None


def shown_name(scope: Scope) -> str | None:
    """Return to whom the certificate is made out that came with a request."""
    name: str | None = scope.get("state", {}).get(_CERTIFICATE)
    return name


def note_member(scope: Scope, member: Member) -> None:
    """Note who asks."""
    scope.setdefault("state", {})[_MEMBER] = member


def operator_of(request: Request) -> str | None:
    """Return the operator whose request it is; None on a page that knows nobody."""
    member: Member | None = request.scope.get("state", {}).get(_MEMBER)
    return member.name if member is not None and member.role is Role.OPERATOR else None
