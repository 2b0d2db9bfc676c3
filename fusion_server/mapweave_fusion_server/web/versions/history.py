"""Versions of the store as JSON, a few kept ready: several people look at the same one."""

from collections import deque
from typing import Any

from mapweave.io.map_files import coverage_content, joint_content
from mapweave.maps import JointMap
from mapweave_fusion_server.store import Store
from mapweave_fusion_server.web.versions.changes import changes_between
from mapweave_fusion_server.web.versions.json_text import to_json
from mapweave_fusion_server.web.versions.recent import Recent
from mapweave_fusion_server.web.versions.told import ToldVersion
from mapweave_protocol.wire.codec import decode
from mapweave_protocol.wire.messages import JointMapMessage

KEPT = 4  # versions, some 100 kB each


class History:
    """Reads versions from a store; usable from several threads.

    What was searched takes longer to work out than all the rest of a version, so it is apart.

    Parameters
    ----------
    store
        Of the coordinator.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._joints: Recent[JointMap] = Recent(self._decoded, KEPT)
        self._told: Recent[ToldVersion] = Recent(self._as_told, KEPT)
        self._coverage: Recent[list[dict[str, Any]]] = Recent(self._searched, KEPT)
        self._texts: Recent[bytes] = Recent(self._encoded, KEPT)
        self._changes: Recent[bytes] = Recent(self._changed, KEPT)
        self._taken: deque[int] = deque(maxlen=KEPT)

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
        return self._joints.get(number)

    def json(self, number: int) -> bytes | None:
        """Return version `number` as ``JOINT.json``, None when there is none."""
        return self._texts.get(number) if 1 <= number <= self.latest else None

    def coverage(self, number: int) -> list[dict[str, Any]] | None:
        """Return what was searched of each component of version `number`, None without one."""
        return self._coverage.get(number)

    def changes(self, number: int) -> bytes | None:
        """Return what makes the version before `number` that one; None unless both were taken."""
        return self._changes.get(number) if {number - 1, number} <= set(self._taken) else None

    def take(self, message: JointMapMessage) -> None:
        """Take a version that has just been made from who made it: it need not be decoded."""
        self._joints.put(message.version, message.unpack())
        self._taken.append(message.version)

    def _decoded(self, number: int) -> JointMap | None:
        payload = self._store.version(number)
        return None if payload is None else decode(JointMapMessage, payload).unpack()

    def _as_told(self, number: int) -> ToldVersion | None:
        joint = self.joint(number)
        return None if joint is None else ToldVersion.of(joint)

    def _searched(self, number: int) -> list[dict[str, Any]] | None:
        joint = self.joint(number)
        if joint is None:
            return None
        return [coverage_content(component.map) for component in joint.components]

    def _encoded(self, number: int) -> bytes | None:
        joint, searched = self.joint(number), self._coverage.get(number)
        if joint is None or searched is None:
            return None
        content = joint_content(joint, searched=False)
        components = zip(content["components"], searched, strict=True)
        return to_json({**content, "components": [{**one, **how} for one, how in components]})

    def _changed(self, number: int) -> bytes | None:
        before, after = self._told.get(number - 1), self._told.get(number)
        return None if before is None or after is None else to_json(changes_between(before, after))
