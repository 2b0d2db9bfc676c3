"""What the fuzzer begins with is read, and what it would tell is told: without the fuzzer."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mapweave.errors import MapweaveError
from mapweave_protocol.wire.codec import decode
from mapweave_protocol.wire.messages import JointMapMessage, MapMessage
from tests.fuzz.targets import Target, _file, targets
from tests.protocol.wire.bombs import KINDS, payload_of

TARGETS = targets()


@pytest.mark.parametrize("name", TARGETS)
def test_what_the_fuzzer_begins_with_breaks_no_rule(name: str) -> None:
    assert TARGETS[name].seeds
    for seed in TARGETS[name].seeds:
        TARGETS[name].rule(seed)


@pytest.mark.parametrize("name", TARGETS)
@given(data=st.data())
@settings(deadline=None, max_examples=30, suppress_health_check=[HealthCheck.too_slow])
def test_bytes_cut_out_put_in_or_changed_break_no_rule(name: str, data: st.DataObject) -> None:
    content = bytearray(data.draw(st.sampled_from(TARGETS[name].seeds)))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content)))
        content[at : at + data.draw(st.integers(0, 3))] = data.draw(st.binary(max_size=5))
    TARGETS[name].rule(bytes(content))


def test_every_kind_of_message_is_fuzzed() -> None:
    assert len(KINDS) == sum(name.startswith("message-") for name in TARGETS)


def test_messages_that_are_at_hand_are_valid() -> None:
    for kind in (MapMessage, JointMapMessage):
        seeds = TARGETS[f"message-{kind.format.replace(' ', '-')}"].seeds[1:]
        assert seeds
        for body in seeds:
            decode(kind, payload_of(kind, body, deflated=False))


@pytest.mark.parametrize("told", ["two\nlines", "x" * 3000, "names no file"])
def test_a_refusal_that_is_not_one_line_about_the_file_breaks_the_rule(told: str) -> None:
    def read(_: object) -> None:
        raise MapweaveError(told)

    broken: Target = _file("a.log", read)
    with pytest.raises(AssertionError):
        broken.rule(b"")
