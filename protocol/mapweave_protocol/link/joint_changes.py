"""Versions of the joint map as what changed: what to publish, and how to make it whole again."""

from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import JointMapMessage

VERSIONS_TO_COMPLETE = 16  # from one complete version to the next at most: a cache holds as many


class JointSender:
    """Turns versions, each complete, into payloads: mostly of what changed."""

    def __init__(self) -> None:
        self._last: JointMapMessage | None = None

    def payload(self, message: JointMapMessage, whole: bytes) -> bytes:
        """Return what to publish so that who has the version before gets this one.

        Parameters
        ----------
        whole
            The payload of `message`, which is a complete version.
        """
        last, self._last = self._last, message
        if last is None or not message.follows(last) or message.version % VERSIONS_TO_COMPLETE == 1:
            return whole
        return min(encode(message.since(last)), whole, key=len)


class JointAssembler:
    """Makes versions whole from those before them; knows neither clock nor network."""

    def __init__(self) -> None:
        self._last: JointMapMessage | None = None

    def update(self, message: JointMapMessage) -> JointMapMessage | None:
        """Return the version of `message`, whole; None if the one before is not here.

        Raises
        ------
        MessageError
            If it is damaged: it does not go with the version before.
        """
        if message.changes:
            if self._last is None or not message.follows(self._last):
                return None
            message = message.over(self._last)
        self._last = message
        return message
