"""What processes take, each with all that it has started: memory and processor time."""

import os
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

MIB = 2**20
_TICK, _PAGE = os.sysconf("SC_CLK_TCK"), os.sysconf("SC_PAGE_SIZE")
_GROUP, _TIMES, _RESIDENT = 2, slice(11, 15), 21  # fields of /proc/PID/stat behind the name


@dataclass(frozen=True)
class Figures:
    """What a process took.

    Attributes
    ----------
    half, end
        Its memory [MiB], on average, in the third and in the last quarter of the time.
    cpu
        Processor time a second, in the second half [s/s].
    """

    name: str
    half: float
    end: float
    cpu: float

    @property
    def numbers(self) -> tuple[float, float, float]:
        """All but the name."""
        return self.half, self.end, self.cpu

    def has_grown(self, share: float, least: float) -> bool:
        """Tell whether its memory grew by more than a share, and by more than `least` [MiB]."""
        return self.end - self.half > max(share * self.half, least)


@dataclass
class Usage:
    """Looks at groups of processes now and then.

    Attributes
    ----------
    seen
        By name, what was seen: when [s], memory [bytes], processor time so far [s].
    """

    seen: dict[str, list[tuple[float, int, float]]] = field(default_factory=dict)

    def look(self, groups: Mapping[str, int]) -> None:
        """Note what each of `groups`, by name, takes now."""
        now, taken = time.monotonic(), _taken()
        for name, group in groups.items():
            self.seen.setdefault(name, []).append((now, *taken.get(group, (0, 0.0))))

    def note(self, name: str, memory: int) -> None:
        """Note what something takes now [bytes] that is no process of its own."""
        self.seen.setdefault(name, []).append((time.monotonic(), memory, 0.0))

    def figures(self) -> list[Figures]:
        """Return what each took in the second half of the time."""
        return [_figures(name, seen) for name, seen in self.seen.items() if len(seen) > 1]


def _figures(name: str, seen: list[tuple[float, int, float]]) -> Figures:
    late = seen[len(seen) // 2 :]
    middle = max(1, len(late) // 2)
    half, end = (
        _mean([memory for _, memory, _ in part]) for part in (late[:middle], late[-middle:])
    )
    passed = late[-1][0] - late[0][0]
    cpu = (late[-1][2] - late[0][2]) / passed if passed else 0.0
    return Figures(name, half / MIB, end / MIB, cpu)


def _mean(values: list[int]) -> float:
    return sum(values) / len(values)


def _taken() -> dict[int, tuple[int, float]]:
    """Return what each process group takes: memory [bytes], processor time [s]."""
    found: dict[int, tuple[int, float]] = {}
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = file.read_text().rpartition(")")[2].split()
        except OSError:
            continue  # it has ended
        group = int(fields[_GROUP])
        memory, cpu = found.get(group, (0, 0.0))
        used = sum(map(int, fields[_TIMES])) / _TICK
        found[group] = memory + int(fields[_RESIDENT]) * _PAGE, cpu + used
    return found
