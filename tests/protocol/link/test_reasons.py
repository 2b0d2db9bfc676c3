"""Why there is no router is told in words, one reason for each place that was tried."""

import socket
import threading

import pytest

from mapweave_protocol.link.reasons import reason_of


@pytest.mark.parametrize(
    ("endpoint", "reason"),
    [
        ("tcp/127.0.0.1:9", "refused: nothing listens there"),
        ("tcp/nowhere.invalid:7447", "no such host"),
        ("tls/[::1]:9", "refused: nothing listens there"),
        ("udp/127.0.0.1:9", "no answer"),
    ],
)
def test_what_keeps_us_out_is_named(endpoint: str, reason: str) -> None:
    assert reason_of([endpoint], None) == f"{endpoint}: {reason}"


def test_each_place_has_its_reason() -> None:
    told = reason_of(["tcp/127.0.0.1:9", "tcp/nowhere.invalid:1"], None)
    assert told.split("; ")[1] == "tcp/nowhere.invalid:1: no such host"


@pytest.mark.parametrize(
    ("protocol", "hint"), [("tcp", "tls/{} and --tls DIR"), ("tls", "--tls DIR")]
)
def test_who_listens_and_does_not_answer_is_told_apart_and_what_one_with_keys_wants(
    protocol: str, hint: str
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        taking = threading.Thread(target=lambda: server.accept()[0].close())
        taking.start()
        address = f"127.0.0.1:{server.getsockname()[1]}"
        wanted = f"lets us in (if it has keys, give {hint.format(address)})"
        assert reason_of([f"{protocol}/{address}"], None).endswith(wanted)
        taking.join()
