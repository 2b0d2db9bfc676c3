"""``mapweave show``: one version of a store."""

import argparse
from pathlib import Path

from mapweave.atomic import check_outputs
from mapweave.cli import Command, argument
from mapweave.io.map_files import write_joint
from mapweave_fusion_server.past.arguments import (
    LATEST,
    add_store_arguments,
    joint_of,
    judgement,
    store_of,
    version_number,
)
from mapweave_protocol.narration.story_joint import tell_components


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "version", type=argument(version_number), metavar="VERSION", help=f"a number, or {LATEST}"
    )
    add_store_arguments(parser)
    parser.add_argument("--output", type=Path, metavar="JOINT.json", help="write it there as well")


def _run(options: argparse.Namespace) -> int:
    check_outputs([options.output], [])
    with store_of(options) as view:
        joint = joint_of(view, options.version)
    print(f"version {joint.version}: {tell_components(joint)}")  # noqa: T201
    for found in joint.alignments:
        print(f"{found.reference} and {found.other}: {judgement(found)}: {found.reason}")  # noqa: T201
    if options.output is not None:
        write_joint(options.output, joint)
    return 0


command = Command(
    "Show one version of a store, or write it as JOINT.json.",
    _configure,
    _run,
    "latest --team rescue --output joint.json",
)
