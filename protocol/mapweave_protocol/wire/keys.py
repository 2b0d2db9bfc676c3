"""Every key, built and parsed in one place from one format string each.

``v2`` names the version of this layout: keys of different versions never match each other. No part
of a key may begin with ``@``: Zenoh keeps such parts out of what it sends again after an outage.
"""

import re
import secrets
from dataclasses import dataclass
from functools import cached_property
from string import Formatter

from mapweave.ids import check_id, is_id
from mapweave_protocol.errors import ForeignKeyError

ANY = "*"


@dataclass(frozen=True)
class KeyFormat:
    """A key with named parts, each a valid id.

    Attributes
    ----------
    text
        The format string; a part is written ``{name}``.
    """

    text: str

    def build(self, **parts: str) -> str:
        """Return the key with these parts.

        Raises
        ------
        InvalidIdError
            If a part is not an id.
        """
        return self.text.format(**{name: check_id(name, part) for name, part in parts.items()})

    def pattern(self, **parts: str) -> str:
        """Return the key expression with these parts, any id matching those not given."""
        checked = {name: check_id(name, part) for name, part in parts.items()}
        return self.text.format(**dict.fromkeys(self.names, ANY) | checked)

    def parse(self, key: str) -> dict[str, str]:
        """Return the parts of `key` by name.

        Raises
        ------
        ForeignKeyError
            If `key` is not of this format.
        InvalidIdError
            If a part of it is not an id.
        """
        match = self._regex.fullmatch(key)
        if match is None:
            raise ForeignKeyError(key, self.text)
        return {name: check_id(name, part) for name, part in match.groupdict().items()}

    def matches(self, key: str) -> bool:
        """Tell whether `key` is of this format, its parts unchecked."""
        return self._regex.fullmatch(key) is not None

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of the parts, in their order."""
        return tuple(name for _, name, _, _ in Formatter().parse(self.text) if name)

    @cached_property
    def _regex(self) -> re.Pattern[str]:
        groups = {name: f"(?P<{name}>[^/]+)" for name in self.names}
        return re.compile(self.text.format(**groups))


MAP = KeyFormat("mapweave/v2/{team}/agent/{robot}/map")
MARK = KeyFormat("mapweave/v2/{team}/agent/{robot}/mark")
POSE = KeyFormat("mapweave/v2/{team}/agent/{robot}/pose")
STATUS = KeyFormat("mapweave/v2/{team}/agent/{robot}/status")
ALIGNMENT = KeyFormat("mapweave/v2/{team}/agent/{robot}/alignment/{reference}/{other}")
JOINT_MAP = KeyFormat("mapweave/v2/{team}/joint/map")
JOINT_QUERY = KeyFormat("mapweave/v2/{team}/joint/query")
JOINT_STATUS = KeyFormat("mapweave/v2/{team}/joint/status")
AGENT_QUERY = KeyFormat("mapweave/v2/{team}/agent/{robot}/query")
ORDER = KeyFormat("mapweave/v2/{team}/operator/{name}/{order}")
COORDINATOR_LIVE = KeyFormat("mapweave/v2/{team}/live/coordinator/{boot}")
LIVE = KeyFormat("mapweave/v2/{team}/live/agent/{robot}/{boot}")


_SENDER = re.compile(
    r"mapweave/v[0-9]+/[^/]+/(?:live/)?"
    r"(?:(?P<coordinator>joint|coordinator)|agent|operator)(?:/(?P<name>[^/]+))?(?:/.*)?"
)
UNKNOWN = "unknown"
COORDINATOR = "coordinator"


def sender_of(key: str) -> str:
    """Return who a message under `key` says it is from: a robot's id, say; not to be believed."""
    match = _SENDER.fullmatch(key)
    if match is None:
        return UNKNOWN
    if match["coordinator"]:
        return COORDINATOR
    return match["name"] if match["name"] and is_id(match["name"]) else UNKNOWN


def everything(team: str) -> str:
    """Return the key expression of all that a team publishes.

    Raises
    ------
    InvalidIdError
        If `team` is not an id.
    """
    return f"mapweave/v2/{check_id('team', team)}/**"


def new_boot() -> str:
    """Return a fresh name for this run of a robot, or this start of a coordinator."""
    return secrets.token_hex(4)  # of the few runs of one robot; it is in most messages
