"""The joint map's versions, told when they join or part what another did not."""

from collections.abc import Iterator
from typing import TypeAlias

from mapweave.maps import JointComponent, JointMap
from mapweave.text import percent

Group: TypeAlias = frozenset[str]
NOTABLE = 0.05  # change of a component's confidence that is worth a line


class JointStory:
    """Tells who is together, and how surely; versions that change neither are not told.

    Attributes
    ----------
    joint
        The last version.
    """

    def __init__(self) -> None:
        self.joint: JointMap | None = None
        self._told: dict[Group, float] = {}  # those together, and the confidence told

    def changed(self, joint: JointMap) -> Iterator[str]:
        """Tell what is new in a version."""
        before, self.joint = self.joint, joint
        together = {_group(c): c.confidence for c in joint.components if len(c.robots) > 1}
        if before is None or together.keys() != self._told.keys():
            how = " comes apart" if self._parts(joint) else ""
            yield f"joint map {joint.version}{how}: {tell_components(joint)}"
            self._told = together
            return
        for group, sure in together.items():
            was = self._told[group]
            if abs(sure - was) >= NOTABLE:
                self._told[group] = sure
                yield (
                    f"joint map {joint.version}: {_names(group)} is now {percent(sure)} sure,"
                    f" {percent(was)} before"
                )

    def _parts(self, joint: JointMap) -> bool:
        """Tell whether some that were told to be together no longer are."""
        now = [_group(component) for component in joint.components]
        return any(sum(not group.isdisjoint(other) for other in now) > 1 for group in self._told)


def tell_components(joint: JointMap) -> str:
    """Return who is together in `joint`, and who is alone."""
    groups = [
        f"{_names(_group(component))} ({percent(component.confidence)})"
        for component in joint.components
        if len(component.robots) > 1
    ]
    alone = sorted(name for c in joint.components if len(c.robots) == 1 for name in c.robots)
    return ", ".join([*groups, *([f"alone: {', '.join(alone)}"] if alone else [])]) or "nothing yet"


def _group(component: JointComponent) -> Group:
    return frozenset(component.robots)


def _names(group: Group) -> str:
    return " + ".join(sorted(group))
