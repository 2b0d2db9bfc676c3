"""Versions of the joint map, each built from what has changed since the one before.

What is made of a submap, of a component, or of two of them, is kept as long as they stay as they
are: rasters, what they say of each other, which submaps fit. All that is kept is what would be made
anew of the same: so a version is the same whatever was built before.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from mapweave.errors import MapweaveError
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import (
    Alignment,
    JointComponent,
    JointMap,
    LineMap,
    RobotMap,
    Submap,
    lines_of,
    submaps_by_component,
)
from mapweave.matching.distance_field import DistanceField
from mapweave.orders import Order
from mapweave.team.alignment_graph import (
    Cluster,
    KnownEdges,
    cluster_components,
    frame_at_middle,
)
from mapweave.team.contradictions import KnownVerdicts
from mapweave.team.joining import JointParameters, Kept, Piece, join
from mapweave.team.joint_optimization import JointOptimizationParameters, JointOptimizer
from mapweave.team.orders.joint_marks import HeldMarks, held_marks, laid_down
from mapweave.team.orders.rulings import Rulings
from mapweave.team.recent import Recent
from mapweave.team.walls.segment_confidence import Witness


class OvertakenError(MapweaveError):
    """A version is not made, as another one is due that has more in it."""


class JointMapBuilder:
    """Builds one version after the other of what a team knows.

    Parameters
    ----------
    parameters
        Of how maps become one.
    weaving
        Of how submaps are moved to where they fit.
    """

    def __init__(
        self,
        parameters: JointParameters | None = None,
        weaving: JointOptimizationParameters | None = None,
    ) -> None:
        self.parameters = parameters or JointParameters()
        self._weaver = JointOptimizer(weaving)
        self._wholes: Recent[tuple[tuple[LineMap, bytes], ...], DistanceField | None] = Recent()
        self._witnesses: Recent[LineMap, Witness | None] = Recent()
        self._verdicts: KnownVerdicts = Recent()
        self._edges: KnownEdges = Recent()
        self._kept = Kept()

    @property
    def has_more(self) -> bool:
        """Whether the last version left submaps uncompared: one more of the same would fit them."""
        return self._weaver.has_more

    def build(
        self,
        maps: Sequence[RobotMap],
        alignments: Sequence[Alignment],
        version: int,
        orders: Sequence[Order] = (),
        *,
        patient: bool = False,
        is_awaited: bool = True,
        is_overtaken: Callable[[], bool] = lambda: False,
    ) -> JointMap:
        """Return what the team knows, its robots' submaps woven together.

        Alignments that contradict others, or what robots saw, are set aside: they stay in the joint
        map as ambiguous, the reason saying so. What operators ordered goes before.

        Parameters
        ----------
        patient
            Whether all submaps are compared that are to be, however long that takes; if not, some
            of many wait for the next version.
        is_awaited
            Whether somebody waits for it: then few are compared. If not, it only goes on comparing.
        is_overtaken
            Asked before walls are joined, which is most of the work, and of one that only compares
            more all the time until then: whether to give it up for one that has more in it.

        Raises
        ------
        OvertakenError
            If it was; what was compared is kept.
        """
        self._weaver.turn(patient=patient, is_awaited=is_awaited, is_overtaken=is_overtaken)
        for kept in (self._wholes, self._verdicts, self._edges):
            kept.turn()
        submaps = submaps_by_component(maps)
        found = {name: self._whole(each) for name, each in submaps.items()}
        rasters = {name: raster for name, raster in found.items() if raster is not None}
        middles = {name: frame_at_middle(found[name]) for name in submaps}
        rulings = Rulings.of(orders, sorted(submaps), middles)
        clusters, judged = cluster_components(
            sorted(submaps),
            rulings.applied(alignments),
            self.parameters.graph,
            rasters,
            self._verdicts,
            rulings.bans,
            self._edges,
        )
        marks = held_marks(maps)
        woven = [self._woven(cluster, submaps, judged) for cluster in clusters]
        if is_overtaken():
            raise OvertakenError
        for made in (self._witnesses, self._kept):
            made.turn()
        joined = tuple(self._join(cluster, poses, submaps, marks) for cluster, poses in woven)
        return JointMap(version, joined, judged, orders=rulings.orders)

    def _whole(self, submaps: Sequence[Submap]) -> DistanceField | None:
        """Return the raster of a component; None where it has seen no wall."""
        key = tuple((s.map, s.pose.tobytes()) for s in submaps)
        return self._wholes.get(key, lambda: rasterise(lines_of(submaps), self.parameters))

    def _woven(
        self,
        cluster: Cluster,
        submaps: Mapping[str, Sequence[Submap]],
        judged: Sequence[Alignment],
    ) -> tuple[Cluster, dict[str, list[FloatArray]]]:
        """Return a cluster and its submaps' poses where they fit; a component alone stays."""
        if len(cluster.poses) == 1:
            return cluster, {name: [s.pose for s in submaps[name]] for name in cluster.poses}
        woven, poses = self._weaver.weave(cluster, submaps, judged)
        return woven, {name: list(those) for name, those in poses.items()}

    def _join(
        self,
        cluster: Cluster,
        poses: Mapping[str, Sequence[FloatArray]],
        submaps: Mapping[str, Sequence[Submap]],
        marks: HeldMarks,
    ) -> JointComponent:
        """Join a cluster, its submaps at `poses` in their components."""
        pieces = {
            name: [
                Piece(s.map, self._witness(s.map), pose, s.joined)
                for s, pose in zip(submaps[name], those, strict=True)
            ]
            for name, those in poses.items()
        }
        joined = join(cluster, pieces, self.parameters, self._kept)
        return replace(joined, marks=laid_down(marks, cluster.poses, submaps, poses))

    def _witness(self, lines: LineMap) -> Witness | None:
        # Not the raster: it takes twelve times the memory, and a team has hundreds of submaps.
        return self._witnesses.get(
            lines, lambda: testify(rasterise(lines, self.parameters), self.parameters)
        )


def testify(raster: DistanceField | None, p: JointParameters) -> Witness | None:
    """Return what the lines of `raster` say of walls; None where there is none."""
    return None if raster is None else Witness.of(raster, p.segments)


def rasterise(lines: LineMap, p: JointParameters) -> DistanceField | None:
    """Return the raster of `lines`; None where there is no wall."""
    return DistanceField.of(lines, p.raster) if len(lines.segments) else None
