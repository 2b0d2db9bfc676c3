"""``mapweave router``: the process through which all the others reach each other."""

import argparse
import re
import sys
import time

import zenoh

from mapweave.cli import Command
from mapweave.errors import MapweaveError
from mapweave_protocol.link.session import router_config
from mapweave_protocol.link.stopping import stop_on_signal

DEFAULT_LISTEN = "tcp/127.0.0.1:7447"
NAP = 0.2  # [s]


class ListenError(MapweaveError):
    """An endpoint the router cannot listen at, most often because its port is in use."""

    def __init__(self, endpoints: list[str], cause: str) -> None:
        super().__init__(f"router: cannot listen at {', '.join(endpoints)} ({cause})")
        self.endpoints = endpoints


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``mapweave router``."""
    parser.add_argument(
        "--listen",
        action="append",
        metavar="ENDPOINT",
        help=f"where to listen, such as tcp/0.0.0.0:7447; repeatable (default {DEFAULT_LISTEN})",
    )
    parser.add_argument(
        "--connect",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="where another router of the team is, tried until it answers; repeatable",
    )


def run(options: argparse.Namespace) -> int:
    """Route until interrupted or terminated."""
    endpoints: list[str] = options.listen or [DEFAULT_LISTEN]
    stopping = stop_on_signal()
    with _open(endpoints, options.connect):
        print(f"router: listening at {', '.join(endpoints)}", file=sys.stderr)  # noqa: T201
        while not stopping():
            # In short naps: a signal that another thread takes does not wake this one.
            time.sleep(NAP)
    return 0


def _open(endpoints: list[str], others: list[str]) -> zenoh.Session:
    try:
        return zenoh.open(router_config(endpoints, others))
    except zenoh.ZError as error:
        raise ListenError(endpoints, cause_of(str(error))) from error


def cause_of(text: str) -> str:
    """Return what the operating system said within Zenoh's long message."""
    said = re.search(r"([^:\[\]]+?) \(os error \d+\)", text)
    return said[1].strip() if said else text.partition("\n")[0]


command = Command(
    "Run the process through which all the others reach each other.",
    configure,
    run,
    "--listen tcp/0.0.0.0:7447",
)
