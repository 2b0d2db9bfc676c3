"""The paths of the last versions, packed: those of a run once, however many versions show it."""

import threading
import zlib
from collections import OrderedDict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import shapely

from mapweave.maps import RobotMap, component_name
from mapweave.pictures.scene import Scene, ScenePath, robot_scenes
from mapweave_fusion_server.web.parts import METRES, rounded
from mapweave_fusion_server.web.versions.json_text import to_json

TOLERANCE = 0.03  # [m] by which a drawn path may miss the driven one: less than a line's width
KEPT_BYTES = 16_000_000  # packed: those of the last hours of a team of twenty
ENTRY_BYTES = 200  # that a version takes for naming one component


@dataclass(frozen=True, slots=True, eq=False)
class RunPaths:
    """The paths of one run of a robot, each in its component's frame.

    Attributes
    ----------
    robot
        Its id.
    newest
        The number of its newest component.
    place
        The component in which the robot is; None where it has no path yet.
    packed
        Component name to what is told of its paths: JSON, packed.
    """

    robot: str
    newest: int
    place: str | None
    packed: Mapping[str, bytes]

    @classmethod
    def of(cls, robot_map: RobotMap, before: "RunPaths | None" = None) -> "RunPaths":
        """Return the paths of a map; what is as it was `before` is not held twice."""
        driven = [s.component for s in robot_map.submaps if len(s.trajectory.pose)]
        place = component_name(robot_map.robot, driven[-1]) if driven else None
        held = set() if before is None else set(before.packed.values())
        packed = {}
        for scene in robot_scenes(robot_map):
            told = zlib.compress(_told(scene, is_place=scene.name == place))
            packed[scene.name] = next((one for one in held if one == told), told)
        return cls(robot_map.robot, max(robot_map.components, default=-1), place, packed)


class VersionPaths:
    """The paths of one version, those of all `runs`.

    Attributes
    ----------
    packed
        Component name to what is told of its paths: JSON, packed.
    robots
        Each robot's component, that of its latest run.
    """

    def __init__(self, runs: Iterable[RunPaths] = ()) -> None:
        in_order = sorted(runs, key=lambda run: run.newest)
        self.packed = {name: told for run in in_order for name, told in run.packed.items()}
        self.robots = {run.robot: run.place for run in in_order if run.place is not None}

    def added_to(self, other: "VersionPaths | None") -> int:
        """Return about how many bytes it takes beside `other`."""
        shared = set() if other is None else {id(packed) for packed in other.packed.values()}
        own = sum(len(packed) for packed in self.packed.values() if id(packed) not in shared)
        return own + ENTRY_BYTES * (1 + len(self.packed))

    def json(self, before: "VersionPaths | None" = None) -> bytes:
        """Return each robot's component, and what is told of the components, as JSON.

        Of those, if `before` is given, what changed since: the others, and which are ``gone``.
        """
        told = {} if before is None else before.packed
        changed = [
            to_json(name) + b":" + zlib.decompress(packed)
            for name, packed in self.packed.items()
            if told.get(name) != packed
        ]
        gone = [name for name in told if name not in self.packed]
        few = {"robots": self.robots, **({} if before is None else {"gone": gone})}
        return b'{"components":{%s},%s' % (b",".join(changed), to_json(few)[1:])


class Paths:
    """The paths of the last versions; those of older ones go, to keep memory bounded."""

    def __init__(self, limit: int = KEPT_BYTES) -> None:
        self._limit = limit
        self._runs: dict[tuple[str, str], tuple[RobotMap, RunPaths]] = {}
        self._kept: OrderedDict[int, VersionPaths] = OrderedDict()
        self._size = 0
        self._lock = threading.Lock()

    def keep(self, version: int, maps: Iterable[RobotMap]) -> None:
        """Keep the paths that `version`, later than those before, was made of.

        Called by one thread; what a map adds is worked out where it is not the one of before.
        """
        self._runs = {(each.robot, each.boot): (each, self._run(each)) for each in maps}
        paths = VersionPaths(run for _, run in self._runs.values())
        with self._lock:
            self._size += paths.added_to(self._kept.get(self._latest))
            self._kept[version] = paths
            while self._size > self._limit and len(self._kept) > 1:
                _, oldest = self._kept.popitem(last=False)
                self._size -= oldest.added_to(next(iter(self._kept.values())))

    @property
    def latest(self) -> int:
        """The last version whose paths are here, 0 when there is none."""
        with self._lock:
            return self._latest

    def of(self, version: int) -> VersionPaths | None:
        """Return the paths of `version`, None where they are no longer kept."""
        with self._lock:
            return self._kept.get(version)

    @property
    def _latest(self) -> int:
        return next(reversed(self._kept), 0)

    def _run(self, robot_map: RobotMap) -> RunPaths:
        known, paths = self._runs.get((robot_map.robot, robot_map.boot), (None, None))
        return paths if paths and known is robot_map else RunPaths.of(robot_map, paths)


def _told(scene: Scene, *, is_place: bool) -> bytes:
    """Return the JSON of a component's paths and, if the robot is there, where it was last."""
    content: dict[str, object] = {"paths": [_path(path) for path in scene.paths]}
    if is_place:
        content["last"] = [round(value, METRES) for value in scene.paths[-1].pose[-1].tolist()]
    return to_json(content)


def _path(path: ScenePath) -> list[list[float]]:
    points = path.pose[:, :2]
    if len(points) > 1:
        points = shapely.get_coordinates(shapely.simplify(shapely.LineString(points), TOLERANCE))
    return rounded(points)
