"""Numbers of few digits as extensions: made once of what travels again and again."""

import msgpack

from mapweave_protocol.wire.coding.extensions import Extended, extended, unextended

VALUES = (0.25, -13.5, "00ff00ff", {"r1/0": (1.0e-3, 2)}, None, ("words", 1 / 3))


def test_values_that_went_through_before_travel_as_those_that_did_not() -> None:
    ready = Extended([extended(value) for value in VALUES])
    assert msgpack.packb(extended((7.5, ready))) == msgpack.packb(extended((7.5, VALUES)))


def test_what_went_through_before_does_not_go_through_again() -> None:
    ready = Extended([extended(value) for value in VALUES])
    assert extended(ready) is ready


def test_numbers_and_names_of_runs_arrive_as_they_were() -> None:
    packed = msgpack.packb(extended(VALUES))
    assert len(packed) < len(msgpack.packb(VALUES))
    assert msgpack.unpackb(packed, use_list=False, ext_hook=unextended) == VALUES
