"""A store keeps what it was told to keep, and the latest version whatever that was."""

import math
from pathlib import Path

import pytest

from mapweave_fusion_server.storage.retention import ALIGNMENTS_OF_A_PAIR, DAY, Retention
from mapweave_fusion_server.store import Store


@pytest.mark.parametrize(
    ("retention", "times", "kept"),
    [
        (Retention(), [1, 2, 3], [1, 2, 3]),
        (Retention(versions=2), [1, 2, 3], [2, 3]),
        (Retention(versions=1), [1, 2, 3], [3]),
        (Retention(age=2 * DAY), [0, DAY, 2.5 * DAY], [2, 3]),
        (Retention(age=1.0), [0, 100, 200], [3]),
        (Retention(age=DAY), [10 * DAY, 10 * DAY, 0], [1, 2, 3]),  # the clock was set back
        (Retention(versions=2, age=math.inf), [3, 2, 1], [2, 3]),
    ],
)
def test_versions_too_many_or_too_old_are_dropped_but_not_the_latest(
    tmp_path: Path, retention: Retention, times: list[float], kept: list[int]
) -> None:
    with Store(tmp_path / "store.sqlite", "rescue", retention) as store:
        for number, time in enumerate(times, 1):
            store.add_version(number, time, str(number).encode())
        there = [n for n in range(1, 4) if store.version(n) is not None]
        assert there == kept
        assert store.oldest_version == kept[0]
        assert list(store.versions_since(0)) == [str(n).encode() for n in kept]


def test_a_store_that_drops_does_not_grow(tmp_path: Path) -> None:
    path = tmp_path / "store.sqlite"
    sizes = []
    for first in (1, 101):
        with Store(path, "rescue", Retention(versions=10)) as store:
            for number in range(first, first + 100):
                store.add_version(number, 0.0, bytes(20_000))
                store.add_alignments(("a", "b"), 0.0, bytes(1000))
                store.keep_map(("a", "x"), 0, 0.0, bytes(20_000))
        sizes.append(path.stat().st_size)
    assert sizes[1] <= 1.1 * sizes[0]


def test_of_a_pair_the_last_findings_stay(tmp_path: Path) -> None:
    with Store(tmp_path / "store.sqlite", "rescue") as store:
        store.add_alignments(("a", "c"), 0.0, b"another pair")
        for number in range(3 * ALIGNMENTS_OF_A_PAIR):
            store.add_alignments(("a", "b"), 0.0, str(number).encode())
        assert store.last_alignments() == [
            b"another pair",
            str(3 * ALIGNMENTS_OF_A_PAIR - 1).encode(),
        ]
        [(rows,)] = store._database.rows("SELECT count(*) FROM alignment")
    assert rows == ALIGNMENTS_OF_A_PAIR + 1
