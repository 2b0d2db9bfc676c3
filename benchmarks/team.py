"""Teams: all stretches of a log joined at once, and again with false alignments among them."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.random import Generator

from benchmarks.logs import find_logs
from benchmarks.pairs import compare
from benchmarks.stretches import Stretch, map_stretches
from benchmarks.tables import format_table
from mapweave.commands.progress import track
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, Submap, lines_of, submaps_by_component
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.reasons import Reason, StatusKind
from mapweave.team.alignment_graph import (
    AlignmentGraphParameters,
    Cluster,
    cluster_components,
)
from mapweave.team.cycles import Edge
from mapweave.team.joint_optimization import JointOptimizationParameters, JointOptimizer
from mapweave.team.min_cut import weakest_cut
from mapweave.text import percent

FALSE_CONFIDENCE = 0.99  # the surest there is
LEAST_ERROR = 2.0  # [m] that a false alignment is off
SAME_POSE = 1e-3  # [m, rad]
HEAD = ["log", "joined", "confidence", "worst pose", "woven"]
TRIALS = ("injected", "held", "undecided")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which logs, how many robots, and how often something false is injected."""
    parser.add_argument("--logs", nargs="+", metavar="NAME", help="which logs (default all)")
    parser.add_argument("--robots", type=int, default=8, metavar="N", help="stretches a log (8)")
    parser.add_argument("--trials", type=int, default=20, metavar="N", help="injections (20)")
    parser.add_argument(
        "--agreeing",
        type=int,
        nargs="+",
        default=[1, 2, 3],
        metavar="N",
        help="injected at once that agree, each as often (1 2 3)",
    )
    parser.add_argument("--seed", type=int, default=1, help="draws what is injected (1)")


@dataclass(frozen=True, eq=False)
class Team:
    """The stretches of a log as a team: their components, alignments and truth."""

    submaps: Mapping[str, Sequence[Submap]]
    rasters: Mapping[str, DistanceField]
    alignments: Sequence[Alignment]
    frames: Mapping[str, FloatArray]
    ends: Mapping[str, FloatArray]

    @classmethod
    def of(cls, stretches: Sequence[Stretch]) -> "Team":
        """Compare all `stretches`."""
        maps = [s.robot_map for s in stretches]
        submaps = submaps_by_component(maps)
        lines = {name: lines_of(each) for name, each in submaps.items()}
        pairs = [compare(a, b) for a, b in track(list(combinations(stretches, 2)), "comparing")]
        parts = {name: part for s in stretches for name, part in s.parts.items()}
        p = DistanceFieldParameters()
        return cls(
            submaps,
            {name: DistanceField.of(one, p) for name, one in lines.items() if len(one.segments)},
            [match.alignment for pair in pairs for match in pair.matches],
            {name: part.frame for name, part in parts.items()},
            {name: part.ends for name, part in parts.items()},
        )

    def join(self, alignments: Sequence[Alignment]) -> tuple[list[Cluster], Sequence[Alignment]]:
        """Return the clusters and what was judged of each of `alignments`."""
        return cluster_components(
            sorted(self.frames), alignments, AlignmentGraphParameters(), self.rasters
        )

    def weave(self, cluster: Cluster, judged: Sequence[Alignment]) -> Cluster:
        """Return `cluster` with its robots' submaps moved to where they fit."""
        woven, _ = JointOptimizer(JointOptimizationParameters(newest=True, at_once=100_000)).weave(
            cluster, self.submaps, judged
        )
        return woven

    def errors(self, cluster: Cluster) -> list[tuple[float, float]]:
        """How far off each component lies, at the median over its map [m], and its turn [rad].

        In the frame that fits the whole cluster to the truth best.
        """
        placed = {n: se2.transform_points(p, self.ends[n]) for n, p in cluster.poses.items()}
        true = {n: se2.transform_points(self.frames[n], self.ends[n]) for n in cluster.poses}
        frame = fit_frame(
            np.concatenate(list(placed.values())), np.concatenate(list(true.values()))
        )
        errors = []
        for name, pose in cluster.poses.items():
            off = se2.transform_points(frame, placed[name]) - true[name]
            turn = se2.wrap(frame[2] + pose[2] - self.frames[name][2])
            errors.append((float(np.median(np.hypot(*off.T))), float(abs(turn))))
        return errors


def run(options: argparse.Namespace) -> None:
    """Join each log's stretches, with and without something false, and print what came of it."""
    rows = []
    for log in find_logs(options.logs):
        team = Team.of(map_stretches(log, options.robots))
        clusters, judged = team.join(team.alignments)
        woven = team.weave(clusters[0], judged)
        trials = [tell for n in options.agreeing for tell in _tell_trials(team, n, options)]
        rows.append([log.name, *_tell_clusters(team, clusters, woven), *trials])
        for alignment in judged:
            if _is_set_aside(alignment):
                print(f"  {alignment.reference} - {alignment.other}: {alignment.reason}")
    print(format_table(HEAD + [f"{n} {what}" for n in options.agreeing for what in TRIALS], rows))
    print(
        "injected: so many false at once, that agree, where more ways than these join the ends of"
        " each without them; held: all set aside, named, poses as without them; undecided: others"
    )


def _tell_clusters(team: Team, clusters: Sequence[Cluster], woven: Cluster) -> list[str]:
    joined = " + ".join(str(len(c.poses)) for c in clusters)
    worst = [_tell_worst(team.errors(cluster)) for cluster in (clusters[0], woven)]
    return [joined, percent(clusters[0].confidence), *worst]


def _tell_worst(errors: Sequence[tuple[float, float]]) -> str:
    distance, turn = (max(each) for each in zip(*errors, strict=True))
    return f"{distance:.2f} m, {np.degrees(turn):.1f}°"


def _tell_trials(team: Team, agreeing: int, options: argparse.Namespace) -> list[str]:
    rng = np.random.default_rng(options.seed)
    (cluster, *_), judged = team.join(team.alignments)
    held, decidable = 0, 0
    for _ in range(options.trials):
        false = false_alignments(team, sorted(cluster.poses), rng, agreeing)
        if all(is_held(cluster, judged, each, len(false) + 1) for each in false):
            decidable += 1
            held += _holds(team, cluster, false)
    return [str(decidable), str(held), str(options.trials - decidable)]


def false_alignments(
    team: Team, names: Sequence[str], rng: Generator, count: int
) -> list[Alignment]:
    """Return wrong alignments of one component to `count` others, which all lay it down alike."""
    b, *others = (names[k] for k in rng.choice(len(names), count + 1, replace=False))
    angle, distance = rng.uniform(-np.pi, np.pi), rng.uniform(LEAST_ERROR, 10.0)
    turn = rng.choice([0.0, np.pi / 2, np.pi])
    off = np.array([distance * np.cos(angle), distance * np.sin(angle), turn])
    middle = np.array([*team.ends[b].mean(axis=0), 0.0])
    moved = se2.compose(se2.compose(team.frames[b], middle), off)
    frame = se2.compose(moved, se2.inverse(middle))
    cause = Reason.words("injected")
    return [
        Alignment(a, b, se2.between(team.frames[a], frame), "accepted", FALSE_CONFIDENCE, cause)
        for a in others
    ]


def is_held(cluster: Cluster, judged: Sequence[Alignment], false: Alignment, ways: int) -> bool:
    """Tell whether so many ways without a common alignment join the ends of `false` already."""
    number = {name: k for k, name in enumerate(cluster.poses)}
    edges = [
        Edge(number[a.reference], number[a.other], a.transform, a.confidence)
        for a in judged
        if a.decision == "accepted" and a.reference in number and a.other in number
    ]
    each = dict.fromkeys(range(len(edges)), 1.0)
    ends = number[false.reference], number[false.other]
    return weakest_cut(range(len(number)), edges, each, *ends).strength >= ways


def _holds(team: Team, cluster: Cluster, false: Sequence[Alignment]) -> bool:
    (there, *_), judged = team.join([*team.alignments, *false])
    return all(map(_is_set_aside, judged[-len(false) :])) and all(
        name in there.poses and np.allclose(there.poses[name], pose, atol=SAME_POSE)
        for name, pose in cluster.poses.items()
    )


def _is_set_aside(alignment: Alignment) -> bool:
    return alignment.status is not None and alignment.status.kind is StatusKind.SET_ASIDE


def fit_frame(points: FloatArray, targets: FloatArray) -> FloatArray:
    """(3,) the rigid motion that brings (n, 2) `points` nearest to `targets`."""
    a, b = points - points.mean(axis=0), targets - targets.mean(axis=0)
    cross = float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())
    turn = float(np.arctan2(cross, float((a * b).sum())))
    shift = targets.mean(axis=0) - se2.rotation(turn) @ points.mean(axis=0)
    return np.array([*shift, turn])
