"""Who may ask: pages of this server and programs of this machine; orders need the token as well.

Where others reach the page, who asks has shown a certificate: members of the team may look, and
operators give orders.

A page of another site can make a browser send requests here: its ``Origin`` says so. One whose name
was made to point to this machine (DNS rebinding) is told by its ``Host``.
"""

import secrets

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from mapweave.text import shown
from mapweave_fusion_server.web.access.member import note_member, shown_name
from mapweave_fusion_server.web.address import HttpAddress
from mapweave_protocol.link.guard.refusals import Refusals
from mapweave_protocol.link.security.roster import Role

TOKEN_HEADER = "X-Mapweave-Token"
CONTENT_SECURITY_POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self'",
        "connect-src 'self'",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'none'",
        "require-trusted-types-for 'script'",
        "trusted-types 'none'",
    )
)
HEADERS = {
    "Content-Security-Policy": CONTENT_SECURITY_POLICY,
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
SAFE_METHODS = {"GET", "HEAD"}


class Guard:
    """Lets a request through to `app`, or says why not; every answer gets the headers above.

    Parameters
    ----------
    app
        What is guarded.
    address
        Where it is served.
    token
        What requests that change something must bring in a header, where nobody shows who he is.
    refusals
        Counts what is refused.
    """

    def __init__(self, app: ASGIApp, address: HttpAddress, token: str, refusals: Refusals) -> None:
        self._app = app
        self._names = address.names
        self._origins = frozenset(address.origins)
        self._keys = address.keys
        self._token = token
        self._refusals = refusals

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            return  # nothing else is spoken here

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(HEADERS)
            await send(message)

        headers = Headers(scope=scope)
        refusal = self._refusal(headers) or self._refusal_of_sender(scope, headers)
        if refusal is not None:
            self._refusals.add("page", "request", scope["path"], refusal)
        app = self._app if refusal is None else PlainTextResponse(f"{refusal}\n", 403)
        await app(scope, receive, send_guarded)

    def _refusal(self, headers: Headers) -> str | None:
        """Return why a request is refused whoever sends it, None if it is not."""
        if headers.getlist("host") not in [[host] for host in self._names]:
            return f"Host: expected {self._names[0]}"
        if not self._origins.issuperset(headers.getlist("origin")):
            return "Origin: expected none but this server's own"
        foreign = headers.get("sec-fetch-site", "none") not in ("none", "same-origin")
        if foreign and headers.get("sec-fetch-mode") != "navigate":  # somebody may follow a link
            return "Sec-Fetch-Site: expected a request of this server's own pages"
        return None

    def _refusal_of_sender(self, scope: Scope, headers: Headers) -> str | None:
        """Return why this one may not ask so, None if it may."""
        changes = scope["method"] not in SAFE_METHODS
        if self._keys is None:
            return self._refusal_of_token(headers) if changes else None
        name = shown_name(scope)
        member = None if name is None else self._keys.roster.member(name)
        if member is None:
            return (
                f"certificate: {shown(name or 'none')} is nobody of team {self._keys.member.team}"
            )
        if changes and member.role is not Role.OPERATOR:
            return f"certificate: {name} gives no orders; expected an operator's"
        note_member(scope, member)
        return None

    def _refusal_of_token(self, headers: Headers) -> str | None:
        given = headers.get(TOKEN_HEADER, "").encode()
        if not secrets.compare_digest(given, self._token.encode()):
            return f"{TOKEN_HEADER}: expected the token of the address that was printed"
        return None
