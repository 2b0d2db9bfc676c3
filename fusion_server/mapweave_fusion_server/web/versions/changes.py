"""What makes a version of the one before it: what stayed is named by its place, and not sent.

A list is told as the pieces that it is made of, in their order: ``[first, end]`` are those items of
the list before, and an object holds new ones by the name of their list.
"""

from collections.abc import Hashable, Mapping, Sequence
from typing import Any, TypeAlias

from mapweave_fusion_server.web.versions.json_text import to_json

Content: TypeAlias = Mapping[str, Any]
Pieces: TypeAlias = list[list[int] | dict[str, Any]]
WALLS = ("polylines", "support", "segment_confidence")  # each has an item a polyline
_NOTHING: Content = {name: [] for name in (*WALLS, "free_space")}


def changes_between(before: Content, after: Content) -> dict[str, Any]:
    """Return what makes `before` `after`: two versions as in ``JOINT.json``, but what was searched.

    Returns
    -------
    dict
        ``components``, each with its ``robots``, ``confidence`` and ``marks``, which component it
        ``was`` (None: none), and the pieces of its ``walls``, three lists that go together, and of
        its ``free_space``; the pieces of ``alignments``; ``orders``, if there are any.
    """
    told, found = ([to_json(each) for each in version["alignments"]] for version in (before, after))
    return {
        "components": [_component(each, before["components"]) for each in after["components"]],
        "alignments": _pieces(told, found, {"alignments": after["alignments"]}),
        **_those_of(after, "orders"),
    }


def _component(after: Content, others: Sequence[Content]) -> dict[str, Any]:
    was = next((k for k, one in enumerate(others) if one["robots"].keys() & after["robots"]), None)
    before = _NOTHING if was is None else others[was]
    walls = {name: after[name] for name in WALLS}
    free = {"free_space": after["free_space"]}
    return {
        "was": was,
        **_those_of(after, "robots", "confidence", "marks"),
        "walls": _pieces(_walls(before), _walls(after), walls),
        "free_space": _pieces(_rings(before), _rings(after), free),
    }


def _those_of(content: Content, *names: str) -> dict[str, Any]:
    return {name: content[name] for name in names if name in content}


def _walls(component: Content) -> list[Hashable]:
    """Return the polylines, each with all that is known of it, as what can be looked up."""
    lists = zip(*(component[name] for name in WALLS), strict=True)
    return [(tuple(map(tuple, p)), tuple(support), tuple(sure)) for p, support, sure in lists]


def _rings(component: Content) -> list[Hashable]:
    return [tuple(map(tuple, ring)) for ring in component["free_space"]]


def _pieces(
    before: Sequence[Hashable], after: Sequence[Hashable], items: Mapping[str, Sequence[Any]]
) -> Pieces:
    """Return the pieces that `after` is made of; `items` are what to tell of it, by their names."""
    pieces: Pieces = []
    first = 0
    places = _places(before, after)
    for end in range(1, len(places) + 1):
        if end < len(places) and _go_on(places[end - 1], places[end]):
            continue
        place = places[first]
        if place is None:
            pieces.append({name: values[first:end] for name, values in items.items()})
        else:
            pieces.append([place, place + end - first])
        first = end
    return pieces


def _places(before: Sequence[Hashable], after: Sequence[Hashable]) -> list[int | None]:
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
