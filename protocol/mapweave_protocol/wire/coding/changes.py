"""What changed of a line map, as a stream: what was there before is there still, or it is not.

A polyline or an area that changed in the least is another one. Those of before are taken in the
order of their numbers, so that both ends ask about them in the same order.
"""

from collections import Counter
from collections.abc import Hashable, Iterable, Sequence
from typing import TypeAlias, TypeVar

from mapweave.kernels.range_coder import Coder
from mapweave_protocol.wire import packing
from mapweave_protocol.wire.coding.free_space_code import CodedFreeSpace, code_free_space
from mapweave_protocol.wire.coding.line_code import CodedLines, code_lines, rows_of

Polyline: TypeAlias = tuple[tuple[int, ...], ...]
Area: TypeAlias = tuple[tuple[tuple[int, ...], ...], ...]

H = TypeVar("H", bound=Hashable)


def code_changed_lines(coder: Coder, before: CodedLines, after: CodedLines | None) -> CodedLines:
    """Code `after`, whose frame is turned as that of `before`, or return what a decoder finds.

    Raises
    ------
    ValueError
        If there is too much of anything, or the frame is turned otherwise.
    """
    wanted = None if after is None else _polylines(after)
    kept, new = _code_kept(coder, "wall stays", sorted(_polylines(before)), wanted)
    confident = before.confidence is not None
    given = None if after is None else _lines(before.turn, new, confident=confident)
    added = code_lines(coder, given, confident=confident)
    if added.turn != before.turn:
        raise ValueError("changes in a frame that is turned otherwise")
    return _lines(before.turn, [*kept, *_polylines(added)], confident=confident)


def code_changed_free_space(
    coder: Coder, before: CodedFreeSpace, after: CodedFreeSpace | None
) -> CodedFreeSpace:
    """Code `after`, in the frame of `before`, or return what a decoder finds.

    Raises
    ------
    ValueError
        If there is too much of anything.
    """
    wanted = None if after is None else _areas(after)
    kept, new = _code_kept(coder, "area stays", sorted(_areas(before)), wanted)
    added = code_free_space(coder, None if after is None else _free_space(new))
    return _free_space([*kept, *_areas(added)])


def _code_kept(
    coder: Coder, context: str, before: Sequence[H], wanted: Sequence[H] | None
) -> tuple[list[H], list[H]]:
    """Code which of `before` stay; return them, and which of `wanted` are none of them."""
    left = Counter(wanted or ())
    kept = []
    for one in before:
        if coder.bit(context, int(left[one] > 0)):
            kept.append(one)
            left[one] -= 1
    new = []
    for one in wanted or ():
        if left[one] > 0:
            new.append(one)
            left[one] -= 1
    return kept, new


def _polylines(lines: CodedLines) -> list[Polyline]:
    rows = rows_of(lines)
    return [tuple(next(rows) for _ in range(count)) for count in lines.counts.tolist()]


def _lines(turn: int, polylines: Sequence[Polyline], *, confident: bool) -> CodedLines:
    rows = packing.whole_numbers([row for polyline in polylines for row in polyline])
    rows = rows.reshape(-1, 6)
    counts = packing.whole_numbers([len(polyline) for polyline in polylines])
    return CodedLines(turn, rows[:, :4], counts, rows[:, 4], rows[:, 5] if confident else None)


def _areas(free: CodedFreeSpace) -> list[Area]:
    return [tuple(tuple(map(tuple, ring.tolist())) for ring in area) for area in free.areas]


def _free_space(areas: Iterable[Area]) -> CodedFreeSpace:
    return CodedFreeSpace(tuple(tuple(map(packing.whole_numbers, area)) for area in areas))
