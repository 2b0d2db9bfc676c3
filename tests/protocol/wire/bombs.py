"""Few bytes that stand for much: payloads that cost whoever unfolds them."""

import zlib
from collections.abc import Iterator

import msgpack

from mapweave_protocol.wire.codec import DEFLATED, MAGIC, PLAIN, VERSION
from mapweave_protocol.wire.dictionary import DICTIONARY
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    JointMapMessage,
    JointStatusMessage,
    MapMessage,
    MarksMessage,
    OrderMessage,
    OrdersMessage,
    PoseMessage,
    RunsMessage,
    StatusMessage,
)
from mapweave_protocol.wire.model import Message

KINDS: tuple[type[Message], ...] = (
    MapMessage, AlignmentMessage, JointMapMessage, JointStatusMessage, StatusMessage, PoseMessage,
    MarksMessage, OrderMessage, OrdersMessage, RunsMessage,
)  # fmt: skip


def payload_of(kind: type[Message], body: bytes, *, deflated: bool = True) -> bytes:
    """Return what travels as a message of `kind`, its body whatever it is."""
    return _head(kind, DEFLATED if deflated else PLAIN) + (_deflated(body) if deflated else body)


def _head(kind: type[Message], packing: bytes) -> bytes:
    return MAGIC + bytes([VERSION]) + kind.letter + packing


def _deflated(body: bytes) -> bytes:
    packer = zlib.compressobj(zlib.Z_BEST_COMPRESSION, zdict=DICTIONARY)
    return packer.compress(body) + packer.flush()


def _bodies() -> Iterator[bytes]:
    """Yield bodies that compress to next to nothing."""
    yield bytes(60 * 2**20)
    for leaf in (b"\x80", b"\x90", b"\xa0", b"\xc0", b"\xcb" + bytes(8), b"\xa9" + b"x" * 9):
        for width, count in ((4096, 4096), (4096, 200), (1_000_000, 1)):
            row = b"\xdd" + width.to_bytes(4, "big") + leaf * width
            yield b"\xdd" + count.to_bytes(4, "big") + row * count
    yield b"\x91" * 1_000_000
    yield b"\x81\xa1x" * 300_000 + b"\xc0"
    names = b"".join(msgpack.packb(f"name {n}") + b"\x80" for n in range(200_000))
    yield b"\xdf" + (200_000).to_bytes(4, "big") + names


def bombs() -> list[tuple[type[Message], bytes]]:
    """Return over a hundred of them, of all kinds, none larger than a megabyte."""
    bodies = [body for body in _bodies() if len(body) < 100 * 2**20]
    deflated = [_deflated(body) for body in bodies]
    found = [(kind, _head(kind, DEFLATED) + packed) for kind in KINDS for packed in deflated]
    return [(kind, payload) for kind, payload in found if len(payload) < 2**20]
