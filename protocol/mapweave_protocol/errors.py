"""What can go wrong on the wire, as exceptions that carry data."""

from pathlib import Path

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
        super().__init__(f"key {key[:120]!r}: expected {expected}")
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


class NotEncryptedError(EndpointError):
    """An endpoint that is not encrypted, where keys are used."""

    def __init__(self, endpoints: tuple[str, ...]) -> None:
        MapweaveError.__init__(
            self,
            f"endpoint {', '.join(endpoints)}: with --tls expected tls/, such as"
            " tls/localhost:7447",
        )
        self.endpoints = endpoints


class WrongKeysError(MapweaveError):
    """Keys of another member than the program that uses them."""

    def __init__(self, folder: Path, whose: str, expected: str) -> None:
        super().__init__(f"{folder}: keys of {whose}; expected those of {expected}")
        self.folder = folder
        self.whose = whose
        self.expected = expected


class UnreachableError(MapweaveError):
    """Nobody answered at the endpoints, or none let us in."""

    def __init__(self, endpoints: tuple[str, ...], seconds: float, reason: str = "") -> None:
        super().__init__(
            f"no router answered at {', '.join(endpoints)} within {seconds:g} s"
            f"{f' ({reason})' if reason else ''}; start one with: mapweave router"
        )
        self.endpoints = endpoints
        self.seconds = seconds
        self.reason = reason
