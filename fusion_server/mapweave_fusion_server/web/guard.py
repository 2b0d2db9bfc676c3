"""Who may ask: pages of this server and programs of this machine; orders need the token as well.

A page of another site can make a browser send requests here: its ``Origin`` says so. One whose name
was made to point to this machine (DNS rebinding) is told by its ``Host``.
"""

import secrets
from collections.abc import Iterable

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from mapweave_fusion_server.web.address import HttpAddress

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
        What requests that change something must bring in a header.
    """

    def __init__(self, app: ASGIApp, address: HttpAddress, token: str) -> None:
        self._app = app
        self._hosts = frozenset(_names_of(address))
        self._token = token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            return  # nothing else is spoken here

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(HEADERS)
            await send(message)

        refusal = self._refusal(scope["method"], Headers(scope=scope))
        app = self._app if refusal is None else PlainTextResponse(f"{refusal}\n", 403)
        await app(scope, receive, send_guarded)

    def _refusal(self, method: str, headers: Headers) -> str | None:
        """Return why a request is refused, None if it is not."""
        if headers.getlist("host") not in [[host] for host in self._hosts]:
            return f"Host: expected {sorted(self._hosts)[0]}"
        origins = headers.getlist("origin")
        if any(origin not in {f"http://{host}" for host in self._hosts} for origin in origins):
            return "Origin: expected none but this server's own"
        foreign = headers.get("sec-fetch-site", "none") not in ("none", "same-origin")
        if foreign and headers.get("sec-fetch-mode") != "navigate":  # somebody may follow a link
            return "Sec-Fetch-Site: expected a request of this server's own pages"
        if method not in SAFE_METHODS:
            return self._refusal_of_order(headers)
        return None

    def _refusal_of_order(self, headers: Headers) -> str | None:
        given = headers.get(TOKEN_HEADER, "").encode()
        if not secrets.compare_digest(given, self._token.encode()):
            return f"{TOKEN_HEADER}: expected the token of the address that was printed"
        return None


def _names_of(address: HttpAddress) -> Iterable[str]:
    yield address.authority
    yield f"localhost:{address.port}"
