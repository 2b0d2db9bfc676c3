"""``mapweave show``: one version of a store."""

import argparse
from collections.abc import Iterator
from pathlib import Path

from mapweave.atomic import check_outputs
from mapweave.cli import Command, add_json_argument, argument, say
from mapweave.io.map_files import alignment_content, write_joint
from mapweave.maps import JointMap
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
    add_json_argument(parser)
    parser.add_argument("--output", type=Path, metavar="JOINT.json", help="write it there as well")


def _run(options: argparse.Namespace) -> int:
    check_outputs([options.output], [])
    with store_of(options) as view:
        joint = joint_of(view, options.version)
    if options.output is not None:
        write_joint(options.output, joint)
    say(options, _content(joint), _lines(joint))
    return 0


def _content(joint: JointMap) -> dict[str, object]:
    """Return what `_lines` tells, as values."""
    return {
        "version": joint.version,
        "components": [sorted(component.robots) for component in joint.components],
        "alignments": [alignment_content(alignment) for alignment in joint.alignments],
    }


def _lines(joint: JointMap) -> Iterator[str]:
    yield f"version {joint.version}: {tell_components(joint)}"
    for found in joint.alignments:
        yield f"{found.reference} and {found.other}: {judgement(found)}: {found.reason}"


command = Command(
    "Show one version of a store, or write it as JOINT.json.",
    _configure,
    _run,
    "latest --team rescue --output joint.json",
)
