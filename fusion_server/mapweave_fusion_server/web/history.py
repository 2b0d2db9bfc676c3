"""Versions of the store as JSON, a few kept ready: several people look at the same one."""

import json
from functools import lru_cache

from mapweave.io.map_files import joint_content
from mapweave.maps import JointMap
from mapweave_fusion_server.store import Store
from mapweave_protocol.wire.codec import decode
from mapweave_protocol.wire.messages import JointMapMessage

KEPT = 4  # versions, some 100 kB each


class History:
    """Reads versions from a store; usable from several threads.

    Parameters
    ----------
    store
        Of the coordinator.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._cached = lru_cache(KEPT)(self._encode)

    @property
    def series(self) -> str:
        """Names the store and its numbering."""
        return self._store.series

    @property
    def latest(self) -> int:
        """The number of the latest version, 0 when there is none."""
        return self._store.latest_version

    def created(self, since: int, limit: int) -> list[tuple[int, float]]:
        """Return number and time [s since 1970] of at most `limit` versions after `since`."""
        return self._store.versions_created(since, limit)

    def joint(self, number: int) -> JointMap | None:
        """Return version `number`, None when there is none."""
        payload = self._store.version(number)
        return None if payload is None else decode(JointMapMessage, payload).unpack()

    def json(self, number: int) -> bytes | None:
        """Return version `number` as ``JOINT.json``, None when there is none."""
        return self._cached(number) if 1 <= number <= self.latest else None

    def _encode(self, number: int) -> bytes | None:
        joint = self.joint(number)
        return None if joint is None else to_json(joint_content(joint))


def to_json(content: object) -> bytes:
    """Return `content` as JSON; angle brackets cannot end a script that it might come into."""
    text = json.dumps(content, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").encode()
