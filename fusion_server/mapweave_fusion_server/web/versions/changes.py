"""What makes a version of the one before it: what stayed is named by its place, and not sent.

A list is told as the pieces that it is made of, in their order: ``[first, end]`` are those items of
the list before, and an object holds new ones by the name of their list.
"""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from mapweave_fusion_server.web.versions.told import ToldComponent, ToldVersion

Pieces: TypeAlias = list[list[int] | dict[str, Any]]


def changes_between(before: ToldVersion, after: ToldVersion) -> dict[str, Any]:
    """Return what makes `before` `after`: two versions as in ``JOINT.json``, but what was searched.

    Returns
    -------
    dict
        ``components``, each with its ``robots``, ``confidence`` and ``marks``, which component it
        ``was`` (None: none), and the pieces of its ``walls``, three lists that go together, and of
        its ``free_space``; the pieces of ``alignments``; ``orders``, if there are any.
    """
    return {
        "components": [_component(each, before.components) for each in after.components],
        "alignments": _pieces(before.alignments, after.alignments, after.alignments_content),
        **after.orders_content(),
    }


def _component(after: ToldComponent, others: Sequence[ToldComponent]) -> dict[str, Any]:
    was = next((k for k, one in enumerate(others) if one.robots & after.robots), None)
    walls, rings = ([], []) if was is None else (others[was].walls, others[was].rings)
    return {
        "was": was,
        **after.content(),
        "walls": _pieces(walls, after.walls, after.walls_content),
        "free_space": _pieces(rings, after.rings, after.free_content),
    }


def _pieces(
    before: Sequence[bytes], after: Sequence[bytes], content: Callable[[int, int], dict[str, Any]]
) -> Pieces:
    """Return the pieces that `after` is made of; `content` tells its items from one to another."""
    pieces: Pieces = []
    first = 0
    places = _places(before, after)
    for end in range(1, len(places) + 1):
        if end < len(places) and _go_on(places[end - 1], places[end]):
            continue
        place = places[first]
        pieces.append(content(first, end) if place is None else [place, place + end - first])
        first = end
    return pieces


def _places(before: Sequence[bytes], after: Sequence[bytes]) -> list[int | None]:
    """Return where each item was, None where it is new; of equal ones what goes on is taken."""
    known = {item: k for k, item in reversed(list(enumerate(before)))}
    places: list[int | None] = []
    following = 0
    for item in after:
        goes_on = following < len(before) and before[following] == item
        place = following if goes_on else known.get(item)
        places.append(place)
        following = following if place is None else place + 1
    return places


def _go_on(place: int | None, following: int | None) -> bool:
    """Tell whether two items that follow each other are of one piece."""
    if place is None or following is None:
        return place is following
    return following == place + 1
