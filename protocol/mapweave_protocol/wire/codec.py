"""Messages to bytes and back.

A payload is a msgpack map ``{"format": …, "deflated": bool, "body": bytes}``; the body is the
msgpack of the message, compressed when that made it smaller. Whatever the bytes, decoding gives a
valid message or raises `MessageError`, and allocates no more than a small multiple of what came
(`budget`).
"""

import zlib
from typing import TypeVar

import msgpack
from pydantic import ValidationError

from mapweave_protocol.errors import MessageError
from mapweave_protocol.wire.budget import MIB, check_objects
from mapweave_protocol.wire.model import MAX_ALIGNMENTS, Message

MAX_PAYLOAD = 16 * MIB  # of any kind

_ENVELOPE = 8  # objects

M = TypeVar("M", bound=Message)


def encode(message: Message) -> bytes:
    """Return the payload of `message`.

    Raises
    ------
    MessageError
        If it is too large to be sent.
    """
    body: bytes = msgpack.packb(message.model_dump())
    deflated, budget = zlib.compress(body), message.budget
    # What comes to too much of too few bytes, receivers refuse.
    smaller = len(deflated) < len(body) <= budget.body_of(len(deflated))
    payload: bytes = msgpack.packb(
        {"format": message.format, "deflated": smaller, "body": deflated if smaller else body}
    )
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
    envelope = _unpack(kind, payload, _ENVELOPE)
    body = _body(kind, envelope, budget.body_of(len(payload)))
    fields = _unpack(kind, body, budget.objects_of(len(payload)))
    try:
        return kind.model_validate(fields)
    except ValidationError as error:
        raise MessageError(kind.format, _first_problem(error)) from error


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
            max_ext_len=0,
        )
    # msgpack raises ValueError and its subclasses for all damage, TypeError for unhashable keys.
    except (ValueError, TypeError) as error:
        raise MessageError(
            kind.format, f"not msgpack as expected ({type(error).__name__})"
        ) from error


def _body(kind: type[Message], envelope: object, most: int) -> bytes:
    match envelope:
        case {"format": kind.format, "deflated": bool(deflated), "body": bytes(body)}:
            return _inflate(kind, body, most) if deflated else body
        case {"format": str(other)}:
            raise MessageError(kind.format, f"found format {other[:64]!r}")
    raise MessageError(kind.format, "expected a map of format, deflated and body")


def _inflate(kind: type[Message], data: bytes, most: int) -> bytes:
    inflater = zlib.decompressobj()
    try:
        body = inflater.decompress(data, most)
    except zlib.error as error:
        raise MessageError(kind.format, "damaged compressed body") from error
    if not inflater.eof or inflater.unused_data:
        raise MessageError(kind.format, f"cut off, or more than {most} bytes decompressed")
    return body


def _first_problem(error: ValidationError) -> str:
    first = error.errors(include_url=False, include_context=False, include_input=False)[0]
    place = ".".join(str(part) for part in first["loc"])
    return f"{place}: {first['msg']}" if place else str(first["msg"])
