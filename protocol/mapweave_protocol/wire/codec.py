"""Messages to bytes and back.

A payload is ``mw``, a byte with the version of the wire, a letter for the kind of message, a byte
that tells how the body is packed, and the body: the msgpack of an array of the message's values (a
map of them by name is read as well), compressed when that made it smaller. Whatever the bytes,
decoding gives a valid message or raises `MessageError`, and allocates no more than a small multiple
of what came (`budget`).
"""

import zlib
from typing import TypeVar

import msgpack
from pydantic import ValidationError

from mapweave.text import in_words
from mapweave_protocol.errors import MessageError
from mapweave_protocol.wire.budget import MIB, check_objects
from mapweave_protocol.wire.coding.extensions import extended, unextended
from mapweave_protocol.wire.dictionary import DICTIONARY
from mapweave_protocol.wire.model import MAX_ALIGNMENTS, Message

MAGIC = b"mw"
VERSION = 3
MAX_PAYLOAD = 16 * MIB  # of any kind
PLAIN, DEFLATED = b"\0", b"\1"
_HEAD = len(MAGIC) + 3
_EARLIER = (0x83,)  # a msgpack map of three, which versions 1 and 2 began with

M = TypeVar("M", bound=Message)


def encode(message: Message) -> bytes:
    """Return the payload of `message`.

    Raises
    ------
    MessageError
        If it is too large to be sent.
    """
    body: bytes = msgpack.packb(extended(message.values()))
    packer = zlib.compressobj(zlib.Z_BEST_COMPRESSION, zdict=DICTIONARY)
    deflated = packer.compress(body) + packer.flush()
    budget = message.budget
    # What comes to too much of too few bytes, receivers refuse.
    smaller = len(deflated) < len(body) <= budget.body_of(len(deflated))
    head = MAGIC + bytes([VERSION]) + message.letter + (DEFLATED if smaller else PLAIN)
    payload = head + (deflated if smaller else body)
    if len(payload) > budget.payload or len(body) > budget.body:
        problem = f"{len(payload)} bytes, expected at most {budget.payload}"
        raise MessageError(message.format, problem)
    return payload


def decode(kind: type[M], payload: bytes) -> M:
    """Return the message of `kind` that `payload` is.

    Raises
    ------
    MessageError
        If it is anything else.
    """
    budget = kind.budget
    if len(payload) > budget.payload:
        raise MessageError(kind.format, f"{len(payload)} bytes, expected at most {budget.payload}")
    body = _body(kind, payload, budget.body_of(len(payload)))
    fields = _unpack(kind, body, budget.objects_of(len(payload)))
    try:
        return kind.model_validate(fields)
    except ValidationError as error:
        raise MessageError(kind.format, _first_problem(error)) from error


def _body(kind: type[Message], payload: bytes, most: int) -> bytes:
    """Return the body, decompressed."""
    _check_head(kind, payload)
    body = payload[_HEAD:]
    match payload[_HEAD - 1 : _HEAD]:
        case b"\0":
            return body
        case b"\1":
            return _inflate(kind, body, most)
    raise MessageError(kind.format, "packed in an unknown way, expected plain or deflated")


def _check_head(kind: type[Message], payload: bytes) -> None:
    if payload[:1] and payload[0] in _EARLIER:
        raise MessageError(kind.format, f"of an earlier version of the wire, expected {VERSION}")
    if len(payload) < _HEAD or not payload.startswith(MAGIC):
        raise MessageError(kind.format, f"expected it to begin with {MAGIC.decode()}")
    if payload[2] != VERSION:
        raise MessageError(kind.format, f"version {payload[2]} of the wire, expected {VERSION}")
    if payload[3:4] != kind.letter:
        raise MessageError(
            kind.format, f"found kind {payload[3:4]!r}, expected {kind.letter.decode()!r}"
        )


def _inflate(kind: type[Message], data: bytes, most: int) -> bytes:
    inflater = zlib.decompressobj(zdict=DICTIONARY)
    try:
        body = inflater.decompress(data, most)
    # Also for another dictionary: its checksum is in the data.
    except zlib.error as error:
        raise MessageError(kind.format, "damaged compressed body") from error
    if not inflater.eof or inflater.unused_data:
        raise MessageError(kind.format, f"cut off, or more than {most} bytes decompressed")
    return body


def _unpack(kind: type[Message], data: bytes, most: int) -> object:
    try:
        check_objects(data, most)
    except ValueError as error:
        raise MessageError(kind.format, str(error)) from error
    try:
        return msgpack.unpackb(
            data,
            use_list=False,
            max_array_len=MAX_ALIGNMENTS,
            max_map_len=MAX_ALIGNMENTS,
            max_ext_len=4,
            ext_hook=unextended,
        )
    # msgpack raises ValueError and its subclasses for all damage, TypeError for unhashable keys.
    except (ValueError, TypeError) as error:
        raise MessageError(
            kind.format, f"not msgpack as expected ({type(error).__name__})"
        ) from error


def _first_problem(error: ValidationError) -> str:
    first = error.errors(include_url=False, include_context=False, include_input=False)[0]
    place = ".".join(str(part) for part in first["loc"])
    return f"{place}: {in_words(first)}" if place else in_words(first)
