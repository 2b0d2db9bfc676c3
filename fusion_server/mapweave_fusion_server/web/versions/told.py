"""A version by what tells its parts from others: bytes, which are compared and kept at no cost.

Held as trees of lists, as in ``JOINT.json``, four versions of 5000 walls are some 100 000 objects.
Now and then Python's collector looks into each of them, 60 ms in which nothing else is done; into
bytes and arrays it does not look.
"""

from collections.abc import Sequence, Set
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.io.annotations import listed, order_content
from mapweave.io.map_files import METRES, alignment_content, component_content
from mapweave.maps import JointComponent, JointMap, LineMap
from mapweave_fusion_server.web.versions.json_text import to_json

WALLS = ("polylines", "support", "segment_confidence")  # each has an item a polyline


@dataclass(frozen=True, slots=True, eq=False)
class ToldComponent:
    """A component of a version.

    Attributes
    ----------
    component
        The component.
    ends
        (p + 1,) where its p polylines end among the segments; the first is 0.
    walls
        What tells a polyline, with its support and confidence, from others.
    rings
        The same for each ring of its free space.
    """

    component: JointComponent
    ends: IntArray
    walls: list[bytes]
    rings: list[bytes]

    @classmethod
    def of(cls, component: JointComponent) -> "ToldComponent":
        """Return `component`; parts that are told in the same digits are the same."""
        lines = component.map
        starts = np.flatnonzero(np.diff(lines.polyline)) + 1
        ends = np.unique([0, *starts.tolist(), len(lines.polyline)])
        rows = np.column_stack([lines.segments, component.segment_confidence, lines.support])
        corners = np.concatenate([np.empty((0, 2)), *lines.free_space])
        rings = np.cumsum([0, *map(len, lines.free_space)], dtype=np.int64)
        return cls(component, ends, _cut(rows, ends), _cut(corners, rings))

    @property
    def robots(self) -> Set[str]:
        """The names of the robots' components in it."""
        return self.component.robots.keys()

    def content(self) -> dict[str, Any]:
        """Return its fields in ``JOINT.json``, but walls, free space and what was searched."""
        fields = self._part(0, 0, ())
        return {name: fields[name] for name in ("robots", "confidence", "marks") if name in fields}

    def walls_content(self, first: int, end: int) -> dict[str, Any]:
        """Return the fields of the polylines from number `first` to before `end`."""
        fields = self._part(first, end, ())
        return {name: fields[name] for name in WALLS}

    def free_content(self, first: int, end: int) -> dict[str, Any]:
        """Return the field of the rings from number `first` to before `end`."""
        rings = self.component.map.free_space[first:end]
        return {"free_space": self._part(0, 0, rings)["free_space"]}

    def _part(self, first: int, end: int, rings: tuple[FloatArray, ...]) -> dict[str, Any]:
        whole, lines = self.component, self.component.map
        own = slice(self.ends[first], self.ends[end])
        part = LineMap(lines.segments[own], lines.polyline[own], lines.support[own], rings)
        sure = whole.segment_confidence[own]
        return component_content(
            JointComponent(whole.robots, whole.confidence, part, sure, whole.marks), searched=False
        )


@dataclass(frozen=True, slots=True, eq=False)
class ToldVersion:
    """A version.

    Attributes
    ----------
    joint
        The joint map.
    components
        Its components.
    alignments
        Each alignment as it is told.
    """

    joint: JointMap
    components: tuple[ToldComponent, ...]
    alignments: list[bytes]

    @classmethod
    def of(cls, joint: JointMap) -> "ToldVersion":
        """Return the version that `joint` is."""
        alignments = [to_json(alignment_content(one)) for one in joint.alignments]
        return cls(joint, tuple(map(ToldComponent.of, joint.components)), alignments)

    def alignments_content(self, first: int, end: int) -> dict[str, Any]:
        """Return the field of the alignments from number `first` to before `end`."""
        return {"alignments": [alignment_content(o) for o in self.joint.alignments[first:end]]}

    def orders_content(self) -> dict[str, Any]:
        """Return the field of the orders, if there are any."""
        return listed("orders", map(order_content, self.joint.orders))


def _cut(rows: FloatArray, ends: Sequence[int] | IntArray) -> list[bytes]:
    """Return the bytes of `rows`, rounded as they are told, cut at `ends`."""
    told = np.ascontiguousarray(np.round(rows, METRES) + 0.0)  # -0 is told as 0
    data, width = told.tobytes(), told.itemsize * told.shape[1]
    places = (np.asarray(ends) * width).tolist()
    return [data[first:end] for first, end in pairwise(places)]
