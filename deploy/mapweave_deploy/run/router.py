"""``mapweave router``: the process through which all the others reach each other."""

import argparse
import re
import sys
import time

import zenoh

from mapweave.cli import Command
from mapweave.errors import MapweaveError
from mapweave_protocol.link.arguments import add_link_arguments, link_of
from mapweave_protocol.link.security.membership import check_member
from mapweave_protocol.link.security.roster import Member, Role
from mapweave_protocol.link.session import router_config
from mapweave_protocol.link.stopping import StopSignals

DEFAULT_LISTEN = "tcp/127.0.0.1:7447"
ENCRYPTED_LISTEN = "tls/127.0.0.1:7447"
NAP = 0.2  # [s]
_HERE = re.compile(r"[a-z]+/(127\.[0-9.]+|localhost|\[::1\]):[0-9]+(?:[#?].*)?$")


class ListenError(MapweaveError):
    """An endpoint the router cannot listen at, most often because its port is in use."""

    def __init__(self, endpoints: list[str], cause: str) -> None:
        super().__init__(f"router: cannot listen at {', '.join(endpoints)} ({cause})")
        self.endpoints = endpoints


class OpenDoorError(MapweaveError):
    """An endpoint that others reach, and no keys."""

    def __init__(self, endpoints: list[str]) -> None:
        super().__init__(
            f"router: whoever reaches {', '.join(endpoints)} may read and write all; expected"
            " --tls DIR (mapweave keys makes it), or --insecure"
        )
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
    parser.add_argument(
        "--insecure", action="store_true", help="listen for other machines without keys, too"
    )
    add_link_arguments(parser)


def run(options: argparse.Namespace) -> int:
    """Route until interrupted or terminated."""
    link = link_of(options)
    encrypted = link.keys is not None
    endpoints: list[str] = options.listen or [ENCRYPTED_LISTEN if encrypted else DEFAULT_LISTEN]
    config = router_config(endpoints, link, options.connect)
    if not encrypted and not options.insecure:
        _check_here(endpoints)
    if link.keys is not None:
        check_member(link, Member(link.keys.member.team, Role.ROUTER, Role.ROUTER.value))
    stopping = StopSignals()
    with _open(endpoints, config):
        print(f"router: listening at {', '.join(endpoints)}", file=sys.stderr)  # noqa: T201
        while not stopping():
            # In short naps: a signal that another thread takes does not wake this one.
            time.sleep(NAP)
    return 0


def _check_here(endpoints: list[str]) -> None:
    """Check that nobody but this machine reaches `endpoints`."""
    reached = [endpoint for endpoint in endpoints if not _HERE.match(endpoint)]
    if reached:
        raise OpenDoorError(reached)


def _open(endpoints: list[str], config: zenoh.Config) -> zenoh.Session:
    try:
        return zenoh.open(config)
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
    "--listen tcp/0.0.0.0:7447 --insecure",
)
