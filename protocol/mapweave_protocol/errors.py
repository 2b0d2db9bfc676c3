"""What can go wrong on the wire, as exceptions that carry data."""

from mapweave.errors import MapweaveError


class MessageError(MapweaveError):
    """A payload that is not the message it should be, or a message that may not be sent.

    Parameters
    ----------
    kind
        The message expected, such as ``mapweave/map/1``.
    problem
        What is wrong with it, and what was expected.
    """

    def __init__(self, kind: str, problem: str) -> None:
        super().__init__(f"message {kind}: {problem}")
        self.kind = kind
        self.problem = problem


class ForeignKeyError(MapweaveError):
    """A key that is not one of ours."""

    def __init__(self, key: str, expected: str) -> None:
        super().__init__(f"key {key!r}: expected {expected}")
        self.key = key
        self.expected = expected


class EndpointError(MapweaveError):
    """An endpoint that is not one."""

    def __init__(self, endpoints: tuple[str, ...]) -> None:
        given = ", ".join(map(str, endpoints)) or "(none)"
        super().__init__(
            f"endpoint {given}: expected a protocol, host and port, such as tcp/localhost:7447"
        )
        self.endpoints = endpoints


class UnreachableError(MapweaveError):
    """Nobody answered at the endpoints."""

    def __init__(self, endpoints: tuple[str, ...], seconds: float) -> None:
        super().__init__(
            f"no router answered at {', '.join(endpoints)} within {seconds:g} s;"
            " start one with: mapweave router"
        )
        self.endpoints = endpoints
        self.seconds = seconds
