"""Which alignments to rely on, and the poses that follow.

Accepted alignments are links between components. The surest links that do not close a circle
carry the poses; a link that closes one must agree with those, or is set aside and named. The
poses are then fitted to all links that agree.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from pydantic import BaseModel, ConfigDict, Field
from scipy.optimize import least_squares

from mapweave import se2
from mapweave.arrays import FloatArray
from mapweave.maps import Alignment


class GraphParameters(BaseModel):
    """When links agree."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    max_distance: float = Field(0.75, gt=0, description="[m] a link may differ from the others'")
    max_turn: float = Field(0.09, gt=0, description="[rad] a link may differ: 5°")
    sigma: float = Field(0.1, gt=0, description="[m] of an alignment's translation")
    turn_sigma: float = Field(0.01, gt=0, description="[rad] of an alignment's rotation")


@dataclass(frozen=True, slots=True, eq=False)
class Cluster:
    """Components whose relative poses are known.

    Attributes
    ----------
    poses
        Component name to its (3,) pose; the first has the identity.
    confidence
        Of the weakest link needed; 1 for one component alone.
    """

    poses: Mapping[str, FloatArray]
    confidence: float


def cluster_components(
    names: Sequence[str], alignments: Sequence[Alignment], parameters: GraphParameters
) -> tuple[list[Cluster], tuple[Alignment, ...]]:
    """Return the clusters, largest first, and `alignments` with those set aside made ambiguous.

    Alignments that name components not in `names` are left out.
    """
    known = set(names)
    alignments = [a for a in alignments if a.reference in known and a.other in known]
    links = [a for a in alignments if a.decision == "accepted"]
    links.sort(key=lambda a: (-a.confidence, -a.evidence.get("score", 0.0), a.reference, a.other))
    tree = _spanning_links(names, links)
    poses, roots = _poses_along(names, tree)
    agreeing = [a for a in links if _agrees(a, poses, parameters)]
    aside = {(a.reference, a.other) for a in links} - {(a.reference, a.other) for a in agreeing}
    judged = tuple(_set_aside(a) if (a.reference, a.other) in aside else a for a in alignments)
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(roots[name], []).append(name)
    clusters = [_cluster(group, poses, tree, agreeing, parameters) for group in groups.values()]
    return sorted(clusters, key=lambda c: -len(c.poses)), judged


def _spanning_links(names: Sequence[str], links: Sequence[Alignment]) -> list[Alignment]:
    """Kruskal's forest over links sorted from the surest."""
    group = {name: name for name in names}

    def root(name: str) -> str:
        while group[name] != name:
            name = group[name]
        return name

    tree = []
    for link in links:
        a, b = root(link.reference), root(link.other)
        if a != b:
            group[max(a, b)] = min(a, b)
            tree.append(link)
    return tree


def _poses_along(
    names: Sequence[str], tree: Sequence[Alignment]
) -> tuple[dict[str, FloatArray], dict[str, str]]:
    """Pose of each component in the frame of its group's first, and that first one's name."""
    neighbours: dict[str, list[tuple[str, FloatArray]]] = {name: [] for name in names}
    for link in tree:
        neighbours[link.reference].append((link.other, link.transform))
        neighbours[link.other].append((link.reference, se2.inverse(link.transform)))
    poses: dict[str, FloatArray] = {}
    roots: dict[str, str] = {}
    for first in names:
        if first in poses:
            continue
        poses[first], roots[first] = np.zeros(3), first
        open_ends = [first]
        while open_ends:
            here = open_ends.pop()
            for there, step in neighbours[here]:
                if there not in poses:
                    poses[there] = se2.compose(poses[here], step)
                    roots[there] = first
                    open_ends.append(there)
    return poses, roots


def _error(link: Alignment, first: FloatArray, second: FloatArray) -> FloatArray:
    """(3,) what `link` and the poses of its two components disagree in."""
    return se2.between(link.transform, se2.between(first, second))


def _agrees(link: Alignment, poses: Mapping[str, FloatArray], p: GraphParameters) -> bool:
    x, y, turn = _error(link, poses[link.reference], poses[link.other])
    return bool(np.hypot(x, y) <= p.max_distance and abs(turn) <= p.max_turn)


def _set_aside(link: Alignment) -> Alignment:
    return replace(
        link, decision="ambiguous", reason=f"set aside: contradicts surer alignments; {link.reason}"
    )


def _cluster(
    group: Sequence[str],
    poses: Mapping[str, FloatArray],
    tree: Sequence[Alignment],
    agreeing: Sequence[Alignment],
    p: GraphParameters,
) -> Cluster:
    inside = [a for a in agreeing if a.reference in group]
    needed = [a.confidence for a in tree if a.reference in group]
    return Cluster(_fitted(group, poses, inside, p), min(needed, default=1.0))


def _fitted(
    group: Sequence[str],
    poses: Mapping[str, FloatArray],
    links: Sequence[Alignment],
    p: GraphParameters,
) -> dict[str, FloatArray]:
    """Fit the poses to all links; the first stays where it is. A tree fits as it stands."""
    start = {name: poses[name] for name in group}
    if len(links) < len(group):
        return start
    place = {name: k for k, name in enumerate(group)}
    scale = np.array([p.sigma, p.sigma, p.turn_sigma])

    def residuals(free: FloatArray) -> FloatArray:
        at = np.vstack([poses[group[0]], free.reshape(-1, 3)])
        return np.concatenate(
            [_error(a, at[place[a.reference]], at[place[a.other]]) / scale for a in links]
        )

    free = np.concatenate([poses[name] for name in group[1:]])
    fitted = least_squares(residuals, free, loss="soft_l1").x.reshape(-1, 3)
    fitted[:, 2] = se2.wrap(fitted[:, 2])
    return {group[0]: poses[group[0]], **dict(zip(group[1:], fitted, strict=True))}
