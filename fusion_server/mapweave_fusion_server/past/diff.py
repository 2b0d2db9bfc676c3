"""``mapweave diff``: what became different from one version of a store to another."""

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Self

from mapweave.cli import Command, add_json_argument, argument, say
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
    add_json_argument(parser)


def _run(options: argparse.Namespace) -> int:
    with store_of(options) as view:
        difference = Difference.of(joint_of(view, options.a), joint_of(view, options.b))
    say(options, asdict(difference), difference.lines())
    return 0


@dataclass(frozen=True, slots=True)
class Difference:
    """What became different from one version to another.

    Attributes
    ----------
    versions, components
        Of either: its number, and whose components its own are of.
    new, gone
        Components that only the later has, or the earlier.
    judged
        Whose alignment is judged otherwise: reference, other, and how it was and is judged.
    wall
        Lengths of all walls of either [m].
    """

    versions: tuple[int, int]
    components: tuple[str, str]
    new: list[str]
    gone: list[str]
    judged: list[tuple[str, str, str, str]]
    wall: tuple[float, float]

    @classmethod
    def of(cls, before: JointMap, after: JointMap) -> Self:
        """Return the difference between two versions."""
        then, now = _names(before), _names(after)
        return cls(
            versions=(before.version, after.version),
            components=(tell_components(before), tell_components(after)),
            new=sorted(now - then),
            gone=sorted(then - now),
            judged=list(_rejudged(_judged(before), _judged(after))),
            wall=(_wall(before), _wall(after)),
        )

    def lines(self) -> Iterator[str]:
        """Yield it in words."""
        for version, components in zip(self.versions, self.components, strict=True):
            yield f"version {version}: {components}"
        yield from (f"{name} is new" for name in self.new)
        yield from (f"{name} is gone" for name in self.gone)
        for reference, other, was, became in self.judged:
            yield f"{reference} and {other}: {was} before, {became} after"
        yield "walls: {:.0f} m before, {:.0f} m after".format(*self.wall)


def _rejudged(
    then: Mapping[tuple[str, str], str], now: Mapping[tuple[str, str], str]
) -> Iterator[tuple[str, str, str, str]]:
    for pair in sorted(then.keys() | now.keys()):
        was, became = then.get(pair, "not compared"), now.get(pair, "no longer compared")
        if was != became:
            yield *pair, was, became


def _names(joint: JointMap) -> set[str]:
    return {name for component in joint.components for name in component.robots}


def _judged(joint: JointMap) -> dict[tuple[str, str], str]:
    return {(a.reference, a.other): judgement(a) for a in joint.alignments}


def _wall(joint: JointMap) -> float:
    return sum(float(lengths(component.map.segments).sum()) for component in joint.components)


command = Command(
    "Tell what became different between two versions.", _configure, _run, "1 latest --team rescue"
)
