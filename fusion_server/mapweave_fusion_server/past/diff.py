"""``mapweave diff``: what became different from one version of a store to another."""

import argparse
from collections.abc import Iterator

from mapweave.cli import Command, argument
from mapweave.geometry.segments import lengths
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
    for name, which in (("a", "A"), ("b", "B")):
        parser.add_argument(
            name, type=argument(version_number), metavar=which, help=f"a number, or {LATEST}"
        )
    add_store_arguments(parser)


def _run(options: argparse.Namespace) -> int:
    with store_of(options) as view:
        before, after = joint_of(view, options.a), joint_of(view, options.b)
    for line in differences(before, after):
        print(line)  # noqa: T201
    return 0


def differences(before: JointMap, after: JointMap) -> Iterator[str]:
    """Yield what is different in `after`, in words; a line that nothing is, where nothing is."""
    yield f"version {before.version}: {tell_components(before)}"
    yield f"version {after.version}: {tell_components(after)}"
    yield from _parts(before, after)
    yield from _judgements(before, after)
    walls, now = _wall(before), _wall(after)
    yield f"walls: {walls:.0f} m before, {now:.0f} m after"


def _parts(before: JointMap, after: JointMap) -> Iterator[str]:
    then, now = _names(before), _names(after)
    for name in sorted(now - then):
        yield f"{name} is new"
    for name in sorted(then - now):
        yield f"{name} is gone"


def _judgements(before: JointMap, after: JointMap) -> Iterator[str]:
    then, now = _judged(before), _judged(after)
    for pair in sorted(then.keys() | now.keys()):
        was, became = then.get(pair, "not compared"), now.get(pair, "no longer compared")
        if was != became:
            yield f"{' and '.join(pair)}: {was} before, {became} after"


def _names(joint: JointMap) -> set[str]:
    return {name for component in joint.components for name in component.robots}


def _judged(joint: JointMap) -> dict[tuple[str, str], str]:
    return {(a.reference, a.other): judgement(a) for a in joint.alignments}


def _wall(joint: JointMap) -> float:
    return sum(float(lengths(component.map.segments).sum()) for component in joint.components)


command = Command(
    "Tell what became different between two versions.", _configure, _run, "1 latest --team rescue"
)
