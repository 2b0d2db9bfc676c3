"""What a query gets from the store, without a network."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from mapweave.errors import MapweaveError
from mapweave_fusion_server.answers import answer
from mapweave_fusion_server.store import Store


@pytest.fixture
def empty(tmp_path: Path) -> Iterator[Store]:
    with Store(tmp_path / "team.sqlite", "rescue") as store:
        yield store


@pytest.fixture
def store(empty: Store) -> Store:
    for number in (1, 2, 3):
        empty.add_version(number, 0.0, f"version {number}".encode())
    empty.keep_map(("a", "x"), 0, 0.0, b"map of a")
    return empty


@pytest.mark.parametrize(
    ("parameters", "payloads"),
    [
        ("", [b"version 3"]),
        ("version=2", [b"version 2"]),
        ("since=1", [b"version 2", b"version 3"]),
        ("since=0", [b"version 1", b"version 2", b"version 3"]),
        ("since=3", []),
        ("since=0;limit=2", [b"version 1", b"version 2"]),
        ("robot=a", [b"map of a"]),
    ],
)
def test_a_query_gets_what_it_asks_for(
    store: Store, parameters: str, payloads: list[bytes]
) -> None:
    assert list(answer(store, parameters)) == payloads


@pytest.mark.parametrize(
    ("parameters", "problem"),
    [
        ("version=9", "no version 9 of the joint map; there are 1 to 3"),
        ("version=0", "no version 0"),
        ("robot=nobody", "no map of robot nobody"),
        ("version=x", "expected one of version=N"),
        ("version=1;since=1", "expected one of version=N"),
        ("colour=red", "expected one of version=N"),
        ("since=99999999999999999999999999", "expected one of version=N"),
    ],
)
def test_a_query_that_cannot_be_answered_is_told_why(
    store: Store, parameters: str, problem: str
) -> None:
    with pytest.raises(MapweaveError, match=problem):
        list(answer(store, parameters))


def test_before_the_first_version_there_is_none(empty: Store) -> None:
    with pytest.raises(MapweaveError, match="there is none yet"):
        list(answer(empty, ""))
    assert list(answer(empty, "since=0")) == []
