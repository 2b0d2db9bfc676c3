"""What a program is told about how to reach the network: keys, and settings of Zenoh's own."""

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import zenoh

from mapweave.errors import FileError
from mapweave.text import shown
from mapweave_protocol.link.security.folder import KeyFolder

TLS_VARIABLE = "MAPWEAVE_TLS"
ZENOH_VARIABLE = "MAPWEAVE_ZENOH_CONFIG"
OURS = {
    "mode": "robots and coordinator are clients of a router",
    "connect": "--connect says it",
    "listen": "--listen says it",
    "access_control": "it is made from the roster that mapweave keys wrote",
    "low_pass_filter": "it is made from the roster that mapweave keys wrote",
    "downsampling": "one allowance for all robots together would silence some of them",
    "qos": "it would outrank what publishers are given, and maps would wait for slow receivers",
    "aggregation": "advanced publishers would no longer be found",
    "namespace": "under other keys nobody of the team would hear this program",
    "adminspace/permissions/write": "whoever reaches it could set all of this otherwise",
    "plugins": "the programs here load none",
    "plugins_loading": "the programs here load none",
    "transport/link/tls": "--tls says it",
    "transport/shared_memory": "it would leave files behind after a kill",
    "transport/link/rx/max_message_size": "it follows from what a message may be",
    "transport/link/tx/lease": "by it robots that fell silent are told",
}
"""What is not taken from a user's file, and why."""


@dataclass(frozen=True, slots=True)
class LinkSettings:
    """How to reach the network.

    Attributes
    ----------
    keys
        By which this program proves who it is; None for none.
    extra
        A configuration file of Zenoh, taken as far as it undoes nothing of ours.
    """

    keys: KeyFolder | None = None
    extra: Path | None = None

    @classmethod
    def of(cls, tls: Path | None, extra: Path | None) -> Self:
        """Read what is in the folder `tls`.

        Raises
        ------
        FileError
            If it is no folder of keys.
        """
        return cls(None if tls is None else KeyFolder.read(tls), extra)

    @classmethod
    def of_environment(cls, environment: Mapping[str, str] = os.environ) -> Self:
        """Read what ``MAPWEAVE_TLS`` and ``MAPWEAVE_ZENOH_CONFIG`` name; errors as of `of`."""
        tls, extra = environment.get(TLS_VARIABLE), environment.get(ZENOH_VARIABLE)
        return cls.of(Path(tls) if tls else None, Path(extra) if extra else None)

    def base(self) -> zenoh.Config:
        """Return the configuration to which ours is added.

        Raises
        ------
        FileError
            If the file of `extra` is none, or would undo something of ours.
        """
        if self.extra is None:
            return zenoh.Config()
        try:
            config = zenoh.Config.from_file(str(self.extra))
        except (zenoh.ZError, OSError) as error:
            problem = f"not a configuration of Zenoh: {shown(str(error), 300)}"
            raise FileError(self.extra, problem) from error
        for path, why in OURS.items():
            if _value(config, path) != _value(zenoh.Config(), path):
                raise FileError(self.extra, f"{path}: not to be set here: {why}")
        return config


def _value(config: zenoh.Config, path: str) -> object:
    try:
        return json.loads(config.get_json(path))
    except zenoh.ZError:
        return None  # a part that is not there is as by default
