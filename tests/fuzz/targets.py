"""What is fuzzed: for each reader a rule that holds whatever the bytes, and bytes to begin with.

A rule returns, or raises what was not meant to be raised. Refusals are `MapweaveError`, which say
in one line what is wrong.
"""

import tempfile
import warnings
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import mapweave
from mapweave.config import Config
from mapweave.errors import MapweaveError
from mapweave.io.grids.map_server import read_grid
from mapweave.io.readers.options import ReadOptions
from mapweave.io.readers.reference_poses import read_reference_poses
from mapweave.io.sources import open_source
from mapweave_protocol.link.assembler import MapAssembler
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import DEFLATED, decode, encode
from mapweave_protocol.wire.dictionary import DICTIONARY
from mapweave_protocol.wire.messages import JointMapMessage, MapMessage
from mapweave_protocol.wire.model import Message
from mapweave_protocol.wire.queries import JointQuery
from tests.mapweave.io.bag_files import lasers, write_bag, write_recording
from tests.mapweave.io.test_fuzz import FLASER, LINES, MAP, TOML
from tests.protocol.conftest import make_random_joint, make_random_map
from tests.protocol.wire.bombs import KINDS, payload_of

MOST_SCANS = 20
MOST_TOLD = 2000  # characters
GRID = (
    b"image: map.pgm\nresolution: 0.1\norigin: [-1.0, 2.0, 0.5]\nnegate: 0\noccupied_thresh: 0.65\n"
    b"free_thresh: 0.196\n"
)
PICTURE = b"P5\n2 2\n255\n\x00\xfe\xcd\x80"
KEY_FORMATS = tuple(each for each in vars(keys).values() if isinstance(each, keys.KeyFormat))
Rule = Callable[[bytes], None]


@dataclass(frozen=True)
class Target:
    """Something that reads.

    Attributes
    ----------
    rule
        What holds.
    seeds
        Bytes that are read.
    """

    rule: Rule
    seeds: tuple[bytes, ...]


def targets() -> dict[str, Target]:
    """Return all of them, by name."""
    return {
        **{f"message-{kind.format.replace(' ', '-')}": _message(kind) for kind in KINDS},
        "keys": Target(_any_key, tuple(key.encode() for key in _keys())),
        "queries": Target(_any_query, (b"", b"since=3", b"version=7", b"latest")),
        "map": _file("a.json", mapweave.load, MAP),
        "configuration": _file("a.toml", lambda path: Config.load(path, {}), TOML),
        "poses": _file("a.log", read_reference_poses, FLASER),
        "log": _file("a.log", _scans, FLASER),
        "lines": _file("a.jsonl", _scans, LINES),
        "grid": Target(_any_grid, (GRID + b"\0" + PICTURE,)),
        **_bags(),
    }


def _message(kind: type[Message]) -> Target:
    """Return the target of a kind of message: its body, which the fuzzer need not deflate."""

    def rule(data: bytes) -> None:
        for payload in (data, payload_of(kind, data, deflated=False)):
            try:
                message = decode(kind, payload)
                _unpack(message)
            except MapweaveError as refused:
                _check_told(refused)
            else:
                assert decode(kind, encode(message)) == message, "another message comes back"

    return Target(rule, _bodies(kind))


def _unpack(message: Message) -> None:
    if isinstance(message, MapMessage):
        MapAssembler().update(message)
    if isinstance(message, JointMapMessage) and not message.changes:
        message.unpack()


def _bodies(kind: type[Message]) -> tuple[bytes, ...]:
    """Return bodies of messages of a kind, where some are at hand."""
    made: dict[type[Message], list[Message]] = {
        MapMessage: [MapMessage.pack(make_random_map(1, n)) for n in (1, 2)],
        JointMapMessage: [JointMapMessage.pack(make_random_joint(n), "s") for n in (1, 3)],
    }
    return (b"\x80", *(_body(encode(message)) for message in made.get(kind, [])))


def _body(payload: bytes) -> bytes:
    head = len(payload_of(MapMessage, b"", deflated=False))
    if payload[head - 1 : head] != DEFLATED:
        return payload[head:]
    return zlib.decompressobj(zdict=DICTIONARY).decompress(payload[head:])


def _keys() -> tuple[str, ...]:
    parts = {"team": "t", "robot": "r1", "boot": "b", "reference": "a", "other": "b"}
    parts |= {"name": "ann", "order": "pin"}
    wanted = [{name: parts[name] for name in each.names} for each in KEY_FORMATS]
    return tuple(each.build(**given) for each, given in zip(KEY_FORMATS, wanted, strict=True))


def _any_key(data: bytes) -> None:
    key = data.decode("utf-8", "replace")
    keys.sender_of(key)
    for each in KEY_FORMATS:
        try:
            assert each.build(**each.parse(key)) == key
        except MapweaveError as refused:
            _check_told(refused)


def _any_query(data: bytes) -> None:
    try:
        query = JointQuery.parse(data.decode("utf-8", "replace"))
    except MapweaveError as refused:
        _check_told(refused)
    else:
        assert JointQuery.parse(query.parameters) == query


def _file(name: str, read: Callable[[Path], object], *seeds: bytes) -> Target:
    def rule(data: bytes) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / name
            path.write_bytes(data)
            _read(read, path)

    return Target(rule, seeds)


def _read(read: Callable[[Path], object], path: Path) -> None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            read(path)
    except MapweaveError as refused:
        _check_told(refused)
        assert path.name in str(refused), str(refused)


def _any_grid(data: bytes) -> None:
    settings, _, picture = data.partition(b"\0")
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "map.pgm").write_bytes(picture)
        path = Path(folder) / "map.yaml"
        path.write_bytes(settings)
        try:
            read_grid(path)
        except MapweaveError as refused:
            _check_told(refused)


def _scans(path: Path) -> object:
    options = ReadOptions(odometry=True, angular_step=None, topic=None, on_warning=lambda _: None)
    return list(islice(open_source(str(path), options).scans(), MOST_SCANS))


def _bags() -> dict[str, Target]:
    topics = {"/scan": lasers(3)}
    with tempfile.TemporaryDirectory() as folder:
        files = {
            "bag": write_bag(Path(folder) / "a.bag", topics),
            "mcap": write_recording(Path(folder) / "mcap", topics, "mcap"),
            "db3": write_recording(Path(folder) / "db3", topics, "sqlite3"),
        }
        return {name: _file(f"a.{name}", _scans, file.read_bytes()) for name, file in files.items()}


def _check_told(refused: MapweaveError) -> None:
    told = str(refused)
    assert "\n" not in told, told
    assert len(told) < MOST_TOLD, told
