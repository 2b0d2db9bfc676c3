"""What a message costs is bounded by what came, before anything is made of it."""

import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapweave.maps import JointMap
from mapweave_protocol.errors import MessageError
from mapweave_protocol.wire.budget import MAX_DEPTH, check_objects
from mapweave_protocol.wire.codec import decode, encode
from mapweave_protocol.wire.messages import AlignmentMessage, MapVersion, StatusMessage
from mapweave_protocol.wire.model import Message
from mapweave_protocol.wire.status_message import MAX_PEERS
from tests.protocol.wire.bombs import KINDS, payload_of

ROOT = Path(__file__).parents[3]
GROWN = 50 * 2**20  # [bytes] a process may grow by
DECODE_BOMBS = """
from mapweave_protocol.errors import MessageError
from mapweave_protocol.wire.codec import decode
from tests.protocol.wire.bombs import bombs

made = bombs()  # before: making them costs more than refusing them
with open("/proc/self/clear_refs", "w") as peak:
    peak.write("5")
def peak_kib():
    return next(int(l.split()[1]) for l in open("/proc/self/status") if l.startswith("VmHWM"))
start, refused = peak_kib(), 0
for kind, payload in made:
    try:
        decode(kind, payload)
    except MessageError:
        refused += 1
print(len(made), refused, 1024 * (peak_kib() - start))
"""

SCALARS = st.one_of(
    st.none(), st.booleans(), st.integers(-(2**63), 2**64 - 1), st.floats(),
    st.text(max_size=300), st.binary(max_size=300),
)  # fmt: skip
STRUCTURES = st.recursive(
    SCALARS,
    lambda inner: st.one_of(
        st.lists(inner, max_size=20), st.dictionaries(st.text(max_size=40), inner, max_size=20)
    ),
    max_leaves=60,
)


def _objects(value: object) -> int:
    if isinstance(value, list):
        return 1 + sum(map(_objects, value))
    if isinstance(value, dict):
        return 1 + sum(1 + _objects(item) for item in value.values())
    return 1


@given(STRUCTURES)
@settings(deadline=None)
def test_every_object_counts_once(value: object) -> None:
    data, count = msgpack.packb(value), _objects(value)
    check_objects(data, count)
    if count > 1:
        with pytest.raises(ValueError, match="objects"):
            check_objects(data, count - 1)


@pytest.mark.parametrize("count", [0, 15, 16, 65_535, 65_536])
@pytest.mark.parametrize("kind", [list, dict])
def test_containers_of_every_size_are_counted(kind: type, count: int) -> None:
    value = list(range(count)) if kind is list else dict.fromkeys(range(count))
    most = 1 + (count if kind is list else 2 * count)
    check_objects(msgpack.packb(value), most)
    if count:
        with pytest.raises(ValueError, match="objects"):
            check_objects(msgpack.packb(value), most - 1)


@pytest.mark.parametrize("size", [0, 31, 32, 255, 256, 65_535, 65_536])
def test_texts_and_bytes_of_every_size_are_passed_over(size: int) -> None:
    value = ["x" * size, b"\x91" * size, msgpack.ExtType(7, b"\x91" * size), 1]
    check_objects(msgpack.packb(value), 5)


def test_what_is_deep_is_refused() -> None:
    check_objects(b"\x91" * (MAX_DEPTH - 1) + b"\xc0", 1000)
    with pytest.raises(ValueError, match="in each other"):
        check_objects(b"\x91" * (MAX_DEPTH + 1) + b"\xc0", 1000)


@given(st.binary(max_size=400))
@settings(deadline=None)
def test_whatever_the_bytes_counting_ends_and_raises_nothing_else(data: bytes) -> None:
    with suppress(ValueError):
        check_objects(data, 50)


@pytest.mark.parametrize("start", [b"\xdd\xff\xff\xff\xff", b"\xdf\x7f\xff\xff\xff"])
def test_a_promise_is_refused_before_it_is_kept(start: bytes) -> None:
    with pytest.raises(ValueError, match="objects"):
        check_objects(start, 100_000)


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="memory as Linux tells it")
def test_a_hundred_bombs_are_refused_and_cost_little() -> None:
    done = subprocess.run(
        [sys.executable, "-c", DECODE_BOMBS],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0, done.stderr
    made, refused, grown = map(int, done.stdout.split())
    assert made >= 100
    assert refused == made
    assert grown < GROWN, f"{grown / 2**20:.0f} MiB"


@given(st.sampled_from(KINDS), st.one_of(STRUCTURES.map(msgpack.packb), st.binary(max_size=200)))
@settings(deadline=None, max_examples=400)
def test_whatever_the_body_it_is_refused_or_valid(kind: type[Message], body: bytes) -> None:
    for deflated in (False, True):
        try:
            message = decode(kind, payload_of(kind, body, deflated=deflated))
        except MessageError as refused:
            assert str(refused).isprintable() or "\n" not in str(refused)
            assert len(str(refused)) < 1000
        else:
            assert decode(kind, encode(message)) == message


@given(st.sampled_from(KINDS), st.binary(max_size=300))
@settings(deadline=None, max_examples=400)
def test_whatever_the_payload_it_is_refused_or_valid(kind: type[Message], payload: bytes) -> None:
    try:
        decode(kind, payload)
    except MessageError as refused:
        assert len(str(refused)) < 1000


def test_the_fullest_status_is_within_its_budget() -> None:
    versions = tuple(
        MapVersion(robot=f"r{n}", boot=f"{n:012x}", version=2**40 + n) for n in range(MAX_PEERS)
    )
    counts = dict.fromkeys(
        ("scans_seen", "scans_placed", "components", "submaps", "map_version"), 1
    )
    message = StatusMessage.model_validate(
        {**counts, "robot": "a", "boot": "b", "stamp": 0.0, "state": "mapping", "holds": versions}
    )
    assert decode(StatusMessage, encode(message)) == message


def test_a_thousand_alignments_of_one_pair_are_within_their_budget(
    random_joint: Callable[[int], JointMap],
) -> None:
    one = next(found for found in random_joint(3).alignments)
    robots = [name.partition("/")[0] for name in (one.reference, one.other)]
    ends = [MapVersion(robot=robot, boot="x", version=3) for robot in robots]
    many = [replace(one, transform=np.array([n, 0.1 * n, 0.0])) for n in range(1000)]
    message = AlignmentMessage.pack(robots[0], ends[0], ends[1], many)
    assert decode(AlignmentMessage, encode(message)) == message
